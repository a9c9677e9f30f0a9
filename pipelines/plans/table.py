"""What plans expected beside what was taken, from the lines that measure.py prints; Markdown.

usage: table.py SCENES.jsonl
"""
import json
import sys


def main():
    rows = [json.loads(l) for l in open(sys.argv[1])]
    print("| scene | law | ν | level | cells | taken [s] | expected over that | taken [MB] | expected over that | the plan itself [s] |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for r in rows:
        head = f"| {r['name']} | {r['what']} | {r['poisson']} | {r['level']} |"
        if "failed" in r:
            print(f"{head} {r['failed']} | | | | | |")
        else:
            print(f"{head} {r['cells']} | {r['s']:.2f} | {r['expected_s'] / r['s']:.2f} | {r['mb']:.0f} | {r['expected_mb'] / r['mb']:.2f} | {r['planning_s']:.1f} |")


main()
