"""Prints the positions of a wrist in a running deployment, or the reason why it is missing.

Usage: python wrist.py demo "right wrist"
"""

import sys
import time

import parallax_client


def main():
    if sys.argv[1:2] in (["-h"], ["--help"]):
        return print(__doc__)
    name = sys.argv[1] if len(sys.argv) > 1 else "demo"
    joint = sys.argv[2] if len(sys.argv) > 2 else "right wrist"
    n, missed, longest, last = 0, 0, 0.0, None
    with parallax_client.connect(name, every=True, wait=True) as client:
        for moment in client.moments(patience=20):
            now = time.monotonic()
            longest = max(longest, now - (last or now))
            n, missed, last = n + 1, missed + moment.n_missed, now
            if moment.followed is None:
                print(f"{moment.frame:6d}  no person: {moment.status}", flush=True)
                continue
            wrist = moment.followed.joint(joint)
            if wrist.position is None:
                print(f"{moment.frame:6d}  {joint}: {wrist.reason}", flush=True)
                continue
            x, y, z = wrist.position
            bar = "#".rjust(int(30 * min(max(x / 2 + 1, 0), 2)) + 1)
            print(f"{moment.frame:6d}  {x:+.3f} {y:+.3f} {z:+.3f} m  +-{wrist.deviation:.3f}  {bar}", flush=True)
    print(f"{n} frames received, {missed} not sent or lost; longest pause {longest:.2f} s")


if __name__ == "__main__":
    main()
