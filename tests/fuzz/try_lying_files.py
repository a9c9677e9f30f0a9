#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs every tool on files that lie: each must refuse them in one line with exit 3, or end well with finite numbers.

try_lying_files.py BIN MAKE_LYING_FILES [EVERY]: BIN has the tools; every EVERYth file is tried (1: all). More than 512 MB or
10 s of processor time are findings. Exit codes 2, 4 and 5 are of options, scenes and solutions that a sane lie leads to,
1 is how hexbench compare says that two files differ.
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

MOST_MB, MOST_SECONDS = 512, 10
ON_LATTICE = ["hexmesh info {f}", "hexmesh info {f} --json", "hexmesh check {f}", "hexmesh surface {f} -o out.stl",
              "hexsolve {f} --example", "hexsolve {f} scene.toml --level 0 -o out.hexresult",
              "hexsolve {f} scene.toml --level 2 -o out.hexresult", "hexsolve {f} scene.toml --plan",
              "hexsolve {f} scene.toml --level 1 --set solve.islands=drop --check",
              "hexexport {f} --level 1 --lattice out.vtu", "hexexport {f} --surface out.vtp"]
ON_RESULT = ["hexexport {f} --lattice out.vtu --surface out.vtp --csv out.csv --report out.json --probe 8,6,4",
             "hexexport {f} --lattice out.pvd --conditions out.vtp --report out.csv", "hexexport {f} --inp out.inp",
             "hexexport {f} --html out.html --transform out.h5", "hexslice planes {f} --color displacement -o pictures",
             "hexslice planes {f} --every 10 --axis axial -o pictures", "hexslice steps {f} -o pictures",
             "hexslice volume {f} -o out.png", "hexbench compare --exact {f} good.hexresult",
             "hexsolve good.hexmesh scene.toml --level 1 --set solve.kind=dynamics --set dynamics.step_s=0.01 "
             "--set dynamics.duration_s=0.02 --set dynamics.start={f} -o out.hexresult"]
READS_ALL = ("hexmesh check", "hexslice", "hexsolve good")  # of all that is in the file, but states that a motion keeps
READS_STATES = ("hexslice steps",)
TEXTS = ("out.vtu", "out.vtp", "out.csv", "out.json", "out.inp")
OUTPUTS = (*TEXTS, "out.hexresult", "out.stl", "out.png", "out.html", "out.h5", "out.pvd")
NOT_FINITE = re.compile(rb"(?<![A-Za-z_])[-+]?(nan|inf)(?![A-Za-z_])", re.IGNORECASE)


class Trial:
    def __init__(self, tools, folder):
        self.tools, self.folder = tools, folder

    def run(self, command):
        """Exit code (negative: a signal), standard output, standard error, processor seconds, peak memory in MB."""
        words = command.split()
        with open(self.folder / "stdout", "wb") as out, open(self.folder / "stderr", "wb") as errors:
            child = subprocess.Popen([str(self.tools / words[0]), *words[1:]], cwd=self.folder, stdout=out, stderr=errors,
                                     preexec_fn=lambda: os.setpriority(os.PRIO_PROCESS, 0, 5))
            _, status, used = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        return (child.returncode, (self.folder / "stdout").read_bytes(), (self.folder / "stderr").read_bytes(),
                used.ru_utime + used.ru_stime, used.ru_maxrss / 1024)

    def findings(self, command, must_be_refused):
        for name in OUTPUTS:
            (self.folder / name).unlink(missing_ok=True)
        code, out, errors, seconds, memory = self.run(command + " --force")
        text = errors.decode(errors="replace")
        lines = sum(": error: " in line for line in text.splitlines())
        if code not in (0, 2, 3, 4, 5) and not (code == 1 and "compare" in command):
            yield f"exit {code}: {text[-300:]}"
        elif code == 3 and (lines != 1 or not text.endswith("\n")):
            yield f"{lines} lines of error: {text[-300:]}"
        if seconds > MOST_SECONDS or memory > MOST_MB:
            yield f"{seconds:.1f} s, {memory:.0f} MB"
        if code != 0:
            return
        if must_be_refused:
            yield "read, expected a refusal"
        for name in TEXTS:
            if (self.folder / name).exists() and NOT_FINITE.search((self.folder / name).read_bytes()):
                yield f"a number in {name} that is not finite"
        if NOT_FINITE.search(out):
            yield "a number on standard output that is not finite"


def main():
    make, every = sys.argv[2], int(sys.argv[3]) if len(sys.argv) > 3 else 1
    found = runs = files = 0
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        trial = Trial(pathlib.Path(sys.argv[1]), folder)
        for command in ("hexscan phantom box --spacing 4 -o box.nrrd",
                        "hexmesh build box.nrrd --material *:young_kpa=10,poisson=0.3 --levels 3 -o good.hexmesh",
                        "hexsolve good.hexmesh --example -o scene.toml",
                        "hexsolve good.hexmesh scene.toml --level 1 --set solve.kind=dynamics --set dynamics.step_s=0.01 "
                        "--set dynamics.duration_s=0.02 -o good.hexresult"):
            code, _, errors, _, _ = trial.run(command)
            if code != 0:
                sys.exit(f"{command}: exit {code}: {errors.decode()}")
        for good, commands in (("good.hexmesh", ON_LATTICE), ("good.hexresult", ON_RESULT)):
            lies = folder / good.partition(".")[2]
            subprocess.run([make, folder / good, lies], check=True)
            (lies / "good").write_bytes((folder / good).read_bytes())  # what links into another file lead to
            for line in (lies / "names").read_text().splitlines()[::every]:
                file, kind, what = line.split("\t")
                files += 1
                for command in commands:
                    runs += 1
                    reads = READS_STATES if what.startswith("/steps/") else READS_ALL
                    must = kind == "refused" and command.startswith(reads)
                    for finding in trial.findings(command.format(f=f"{lies.name}/{file}"), must):
                        found += 1
                        print(f"{what}: {command.format(f=file)}: {finding}", flush=True)
                (lies / file).unlink()
    print(f"{files} files that lie, {runs} commands, {found} findings")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
