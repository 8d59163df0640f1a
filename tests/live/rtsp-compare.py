"""Compares the runs of tests/live/rtsp: the pictures that the cameras showed at each instant, from the recording, and the 3D joints.

usage: rtsp-compare.py FOLDER REFERENCE.trc
"""
import json
import math
import struct
import sys

JOINTS = {"shoulder": "Shoulder", "elbow": "Elbow", "wrist": "Wrist", "hip": "Hip", "knee": "Knee", "ankle": "Ankle"}
LIMBS = {f"{side} {ours}": side[0].upper() + theirs for side in ["right", "left"] for ours, theirs in JOINTS.items()}
RATE_HZ = 1.0
SLOWER = 60
LAST = 65  # the last frame with a valid reference


def pictures(file):
    """Returns, for every camera of a recording, the times of its pictures (in instants) and their numbers in the file."""
    topics, found = {}, {}
    with open(file, "rb") as f:
        data = f.read()

    def records(begin, end):
        while begin + 9 <= end:
            op, length = struct.unpack_from("<BQ", data, begin)
            yield op, begin + 9, begin + 9 + length
            begin += 9 + length

    def take(op, begin, end):
        if op == 4:
            number, _, length = struct.unpack_from("<HHI", data, begin)
            topics[number] = data[begin + 8:begin + 8 + length].decode()
        elif op == 5:
            number = struct.unpack_from("<H", data, begin)[0]
            if topics.get(number, "").startswith("picture/"):
                head = begin + 22 + 4
                captured = struct.unpack_from("<Q", data, head + 16)[0]
                status, form = struct.unpack_from("<I4s", data, head + 56)
                presented, start, rate = struct.unpack_from("<QQd", data, head + 72)
                if status == 0 and form in (b"MKV1", b"MKV2"):
                    instant = (captured - start) * 1e-9 * rate
                    found.setdefault(topics[number], []).append((instant, round(presented * 1e-9 * RATE_HZ)))

    for op, begin, end in records(8, len(data)):
        if op == 6:
            compression = struct.unpack_from("<I", data, begin + 28)[0]
            inside = begin + 32 + compression + 8
            for record in records(inside, end):
                take(*record)
        else:
            take(op, begin, end)
    return [found[topic] for topic in sorted(found)]


def shown(cameras):
    """Returns, for every instant, the number of the picture that each camera showed."""
    all_of = {}
    for camera, seen in enumerate(cameras):
        for instant, number in seen:
            nearest = round(instant)
            known = all_of.setdefault(nearest, {}).get(camera)
            if known is None or abs(instant - nearest) < known[0]:
                all_of[nearest][camera] = (abs(instant - nearest), number)
    return {k: [it[c][1] for c in sorted(it)] for k, it in all_of.items() if len(it) == len(cameras)}


def skeletons(file):
    frames = {}
    for line in open(file):
        it = json.loads(line)
        # The followed person.
        joints = it["people"][0]["joints"] if it["people"] else {}
        frames[it["frame"]] = {n: joints[n]["position_m"] for n in LIMBS if (joints.get(n) or {}).get("position_m")}
    return frames


def reference(file):
    lines = [line.split("\t") for line in open(file).read().splitlines()]
    column = {name: n for n, name in enumerate(lines[3]) if name}
    frames = {}
    for nth, row in enumerate(lines[5:]):
        if len(row) > 3:
            at = {ours: [float(v) for v in row[column[theirs]:column[theirs] + 3]] for ours, theirs in LIMBS.items()}
            frames[nth] = {name: [z, x, y] for name, (x, y, z) in at.items()}
    return frames


def between(frames, at):
    """Returns the skeleton at a time between two frames."""
    low = math.floor(at)
    a, b, share = frames.get(low, {}), frames.get(math.ceil(at), {}), at - low
    return {n: [p + share * (q - p) for p, q in zip(a[n], b[n])] for n in a if n in b}


def differences(first, second):
    return [1000 * math.dist(first[n], second[n]) for n in first if n in second]


def line(name, all_mm, n_frames):
    if not all_mm:
        print(f"{name}: no joints")
        return None
    all_mm = sorted(all_mm)
    median, p90 = [all_mm[int(share * (len(all_mm) - 1))] for share in (0.5, 0.9)]
    print(f"{name:52} {median:7.1f} {p90:7.1f} mm (median, p90), {len(all_mm)} joints of {n_frames} frames")
    return median


folder = sys.argv[1]
truth = reference(sys.argv[2])
runs = {name: skeletons(f"{folder}/{name}/pose3d.jsonl") for name in ["originals", "files", "live", "replay"]}
instants = shown(pictures(f"{folder}/live.mcap"))
apart = [max(it) - min(it) for it in instants.values()]
print(f"{len(instants)} instants with a picture of every camera; the numbers of their pictures differ by at most {max(apart)},",
      f"or {max(apart) / RATE_HZ / SLOWER * 1000:.1f} ms of the scene")
errors = {}
for name in ["originals", "files"]:
    frames = range(1, LAST)
    mm = [differences(runs[name].get(k, {}), truth[k]) for k in frames]
    errors[name] = line(f"{name} to the reference", sum(mm, []), sum(map(bool, mm)))
for name in ["live", "replay"]:
    to_truth, to_files = [], []
    for instant, numbers in sorted(instants.items()):
        at = sum(numbers) / len(numbers)
        if 1 <= at < LAST - 1:
            mine = runs[name].get(instant, {})
            to_truth.append(differences(mine, between(truth, at)))
            to_files.append(differences(mine, between(runs["files"], at)))
    errors[name] = line(f"{name} to the reference, at the same pictures", sum(to_truth, []), sum(map(bool, to_truth)))
    line(f"{name} to the files, at the same pictures", sum(to_files, []), sum(map(bool, to_files)))
mm = [differences(runs["files"].get(k, {}), runs["originals"].get(k, {})) for k in range(1, LAST)]
line("files compressed again to the originals", sum(mm, []), sum(map(bool, mm)))
bad = [name for name, error in errors.items() if error is None or error > 1.25 * errors["originals"] + 10]
print(f"FAILED: {', '.join(bad)}" if bad else "the cameras give the same results as the files")
sys.exit(bool(bad))
