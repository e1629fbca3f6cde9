"""Prints, in Markdown, what `quadstep what-if` answers to the arguments given, or why it refuses."""

import json
import subprocess
import sys

WORDS = {
    "largest_error[m]": "largest error, m",
    "position_rmse[m]": "position error (RMSE), m",
    "rotor_activity[N/s]": "rotor activity, N/s",
}

# A pull request may change any file: nothing of it is run as code.
command = ["quadstep", "--no-user-code", "what-if", *sys.argv[1:], "--out", "out", "--page", "--json"]
done = subprocess.run(command, check=False, capture_output=True, text=True)
if done.returncode:
    print(done.stderr.strip().splitlines()[-1].removeprefix("quadstep: error: "))
    sys.exit()
found = json.loads(done.stdout)


def row(name, one, words):
    """A row of the table: a value before and after, each in such words."""
    return f"| {name} | " + " | ".join(words.format(**one[when]) for when in ("before", "after")) + " |"


print(found["answer"], "", "| | before | after |", "|---|---|---|", sep="\n")
print(row("at rest", found["grades"], "{grade}: {why}"))
failed = {when: {part: 100 * share for part, share in one.items()} for when, one in found["failed"].items()}
print(row("failed in gusts", failed, "{value:.3g} % ({low:.3g} to {high:.3g})"))
for name, words in WORDS.items():
    print(row(words, found["metrics"][name], "{value:.3g}"))
print(*(f"\nWarning: {one}" for one in found.get("warnings", ())), sep="\n")
print("", "Intervals are 95 %. Report and page are the run's artifacts.", sep="\n")
