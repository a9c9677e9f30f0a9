#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs what the manual tells its readers to run: every ```sh and ```python block of README.md, docs/tutorial.md and the task pages.

usage: run_blocks.py SOURCE_FOLDER BIN_FOLDER [PAGE...]          (PAGE: only these, e.g. docs/tasks/contact.md)

A block runs in bash with set -euo pipefail and BIN_FOLDER first in PATH; each page has a folder of its own, in which its
blocks run one after the other. A ```toml block whose first line is a comment with nothing but a file's name, `# scene.toml`,
is written to that file, as a reader would. Other ```toml blocks are parts of scenes: their keys must be known, where the folder
has a liver.hexmesh to ask about. Blocks that are not to be run (installing, many hours, other programs) are
```console or indented text.

What is in the folder before the first block:
  README.md         the reader's own scan: segmentation.nii.gz and ct.nii.gz. They are the bundled phantom's, with the numbers
                    that TotalSegmentator gives: 5 = liver. See make_scan().
  docs/tutorial.md  nothing.
  a task page       what the tutorial leaves there; `scans.md` also files of other programs, see make_other_scans().
The page on many processes is left out where hexsolve-mpi is not built.
"""
import gzip
import importlib.util
import os
import pathlib
import re
import shlex
import shutil
import struct
import subprocess
import sys
import tempfile
import time

TUTORIAL = "docs/tutorial.md"
SECONDS_OF_A_BLOCK = 300


def blocks_of(page):
    """(line number, language, text) of each fenced block."""
    language, began, lines = None, 0, []
    for number, line in enumerate(page.read_text().splitlines(), 1):
        fence = re.match(r"```(\w*)", line)
        if fence and language is None:
            language, began, lines = fence[1] or "text", number + 1, []
        elif fence:
            yield began, language, "\n".join(lines) + "\n"
            language = None
        elif language is not None:
            lines.append(line)


def package_of(binaries):
    """The Python package, which may not be built."""
    return binaries.parent / "python" / "hextools"


def environment(binaries):
    return {**os.environ, "PYTHONPATH": str(package_of(binaries).parent), "PATH": f"{binaries}:{os.environ['PATH']}", "OMP_WAIT_POLICY": "passive",
            "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMPI_MCA_rmaps_base_oversubscribe": "1"}


def bash(text, folder, binaries):
    return subprocess.run(["bash", "-euo", "pipefail", "-c", text], cwd=folder, env=environment(binaries), text=True,
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          timeout=SECONDS_OF_A_BLOCK)


def run_or_exit(text, folder, binaries, where):
    result = bash(text, folder, binaries)
    if result.returncode != 0:
        sys.exit(f"{where}: exit code {result.returncode} of\n{text}\n{result.stdout}")


def nifti_of(nrrd, nifti, relabel=None):
    """A NIfTI-1 file of a scan or segmentation that hexscan wrote (gzip, axes L, P, S): as segmentation programs write them."""
    header, _, data = nrrd.read_bytes().partition(b"\n\n")
    fields = dict(line.split(": ", 1) for line in header.decode().splitlines() if ": " in line and line[0] != "#")
    voxels = gzip.decompress(data)
    kind, bits = {"unsigned short": (512, 16), "uint16": (512, 16), "ushort": (512, 16), "short": (4, 16), "int16": (4, 16),
                  "float": (16, 32)}[fields["type"]]
    if relabel:
        values = struct.unpack(f"<{len(voxels) // 2}H", voxels)
        voxels = struct.pack(f"<{len(values)}H", *(relabel.get(value, value) for value in values))
    numbers = [float(n) for n in re.findall(r"-?[\d.]+(?:e-?\d+)?", fields["space directions"])]
    origin = [float(n) for n in fields["space origin"].strip("()").split(",")]
    sizes = [int(n) for n in fields["sizes"].split()]
    out = bytearray(352)
    struct.pack_into("<i", out, 0, 348)
    struct.pack_into("<8h", out, 40, 3, *sizes, 1, 1, 1, 1)
    struct.pack_into("<2h", out, 70, kind, bits)
    struct.pack_into("<8f", out, 76, 1, *(sum(c * c for c in numbers[3 * a:3 * a + 3]) ** 0.5 for a in range(3)), 0, 0, 0, 0)
    struct.pack_into("<3f", out, 108, 352, 1, 0)
    out[123] = 2  # mm
    struct.pack_into("<2h", out, 252, 0, 1)  # sform: scanner coordinates, R, A, S
    for axis, sign in enumerate((-1, -1, 1)):
        row = [sign * numbers[3 * a + axis] for a in range(3)] + [sign * origin[axis]]
        struct.pack_into("<4f", out, 280 + 16 * axis, *row)
    out[344:348] = b"n+1\0"
    nifti.write_bytes(gzip.compress(bytes(out) + voxels, 1))


def make_scan(folder, binaries):
    """segmentation.nii.gz (5 = liver, 6 = tumour, 7 = vessel) and ct.nii.gz."""
    run_or_exit("hexscan -q phantom liver --spacing 4 --intensity-out made_ct.nrrd -o made.nrrd", folder, binaries, "phantom")
    nifti_of(folder / "made.nrrd", folder / "segmentation.nii.gz", {1: 5, 2: 6, 3: 7})
    nifti_of(folder / "made_ct.nrrd", folder / "ct.nii.gz")


def make_other_scans(folder, binaries):
    """One mask per organ, a .seg.nrrd, and two closed surfaces."""
    make_scan(folder, binaries)
    run_or_exit("hexscan -q segmentation.nii.gz --segment 5=liver -o one.nrrd;"
                "hexscan -q segmentation.nii.gz --segment 6=tumour -o two.nrrd;"
                "cp liver.nrrd case.seg.nrrd;"
                "hexmesh surface liver.hexmesh --segment liver -o body.stl;"
                "hexmesh surface liver.hexmesh --segment tumour -o inside.obj", folder, binaries, "other scans")
    nifti_of(folder / "one.nrrd", folder / "liver.nii.gz")
    nifti_of(folder / "two.nrrd", folder / "tumour.nii.gz")


def check_keys(text, folder, binaries, where):
    """A part of a scene need not fit this organ, but it is TOML, and its keys are those of scenes."""
    (folder / "part_of_a_scene.toml").write_text(text)
    result = bash("hexsolve liver.hexmesh part_of_a_scene.toml --check", folder, binaries)
    if re.search("unknown key|selects in|Error while parsing", result.stdout):
        sys.exit(f"{where}: {result.stdout}")


def run_page(source, page, folder, binaries):
    count, began = 0, time.monotonic()
    for line, language, text in blocks_of(source / page):
        name = re.match(r"# ([\w.-]+\.toml)\n", text)
        if language == "toml" and name:
            (folder / name[1]).write_text(text)
        elif language == "toml" and (folder / "liver.hexmesh").exists():
            check_keys(text, folder, binaries, f"{page}:{line}")
        elif language == "sh":
            run_or_exit(text, folder, binaries, f"{page}:{line}")
            count += 1
        elif language == "python" and package_of(binaries).exists() and importlib.util.find_spec("numpy"):
            (folder / "block.py").write_text(text)
            run_or_exit(f"{shlex.quote(sys.executable)} block.py", folder, binaries, f"{page}:{line}")
            count += 1
    print(f"{page}: {count} blocks, {time.monotonic() - began:.1f} s", flush=True)
    return count


def main():
    source, binaries = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
    tasks = sorted(str(page.relative_to(source)) for page in (source / "docs" / "tasks").glob("*.md"))
    pages = sys.argv[3:] or ["README.md", TUTORIAL, *tasks]
    with tempfile.TemporaryDirectory() as temporary:
        root = pathlib.Path(temporary)
        if "README.md" in pages:
            (root / "readme").mkdir()
            make_scan(root / "readme", binaries)
            run_page(source, "README.md", root / "readme", binaries)
        if pages == ["README.md"]:
            return
        (root / "tutorial").mkdir()
        run_page(source, TUTORIAL, root / "tutorial", binaries)
        for page in pages:
            if page in ("README.md", TUTORIAL):
                continue
            if page.endswith("many-processes.md") and not (binaries / "hexsolve-mpi").exists():
                print(f"{page}: left out, hexsolve-mpi is not built")
                continue
            folder = root / pathlib.Path(page).stem
            shutil.copytree(root / "tutorial", folder)
            if page.endswith("scans.md"):
                make_other_scans(folder, binaries)
            run_page(source, page, folder, binaries)
            shutil.rmtree(folder)


main()
