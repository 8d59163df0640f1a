"""Parts of tests/live/hosts: runs on one and on three hosts, faults of the link, and the counts of all frames."""

import json, math, os, random, re, signal, subprocess, sys, time

parallax, out, n_cameras, seconds, rate, carry = sys.argv[1:7]
n_cameras, seconds, rate = int(n_cameras), int(seconds), float(rate)
n_frames = int(seconds * rate)
SET = os.environ.get("SET", "").split()
if os.environ.get("FILTERS"):
    # These settings are light enough for a busy machine: filters near the last pose, on small frames.
    SET += ["method=paper", "paper.search=tracked", "capture.scale=0.4", "capture.upright=true"]
    if carry == "poses":
        SET.append("paper.views=pairs")
# Offsets of the hosts' monotonic clocks from the fusing host's clock, in seconds.
CLOCKS = {"left": 5000, "right": 900000}
LIMBS = [("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist")]
LIMBS = [(f"{s} {a}", f"{s} {b}") for s in ("left", "right") for a, b in LIMBS] + [("neck", "head")]


def sh(*command, check=True):
    return subprocess.run(command, check=check, capture_output=True, text=True)


def say(part, **values):
    print(json.dumps({"part": part, **values}), flush=True)


def write(folder, keys):
    """Writes a deployment of synthetic cameras: half of them on the fusing host, the others on two more hosts."""
    sh(f"{parallax}-lab", "synth", folder, "--live", "--frames", str(n_frames), "--rig", f"ring:{n_cameras}",
       "--actions", "walking", "--rate", str(rate))
    text = open(f"{folder}/deployment.toml").read()
    names = re.findall(r'^name = "(c\d+)"', text, re.M)
    near, far = names[: n_cameras // 2], names[n_cameras // 2 :]
    left, right = far[: len(far) // 2], far[len(far) // 2 :]
    quoted = lambda all: "[" + ", ".join(f'"{it}"' for it in all) + "]"
    text = re.sub(r'^name = ".*"', 'name = "px-test"', text, count=1, flags=re.M)
    open(f"{folder}/one.toml", "w").write(text)
    text += f'\n[link]\ncarry = "{carry}"\n' + (f'keys = "{keys}"\n' if keys else "insecure = true\n")
    text += f'[[host]]\nname = "desk"\nfuses = true\naddress = "10.77.0.1:7447"\nviews = {quoted(near)}\n'
    open(f"{folder}/two.toml", "w").write(text + f'[[host]]\nname = "left"\nviews = {quoted(far)}\n')
    text += f'[[host]]\nname = "left"\nviews = {quoted(left)}\n[[host]]\nname = "right"\nviews = {quoted(right)}\n'
    open(f"{folder}/hosts.toml", "w").write(text)
    return [int(it[1:]) - 1 for it in left], [int(it[1:]) - 1 for it in right]


def run(file, out, *more, ns=None, clock=0, log=None, errors=None, record=None):
    what = ["record", file, "--results", out, "--out", record, "--force"] if record else ["run", file, "--out", out, "--force"]
    command = [parallax, *what, "--set", "supervise.deadline_ms=1500",
               "--set", "supervise.hang_limit_s=120", "--set", "results.overlay_every=0"]
    for it in SET:
        command += ["--set", it]
    command += list(more)
    if clock:
        command = ["unshare", "--fork", "--time", "--monotonic", str(clock)] + command
    if ns:
        command = ["ip", "netns", "exec", f"px-{ns}"] + command
    errors = open(errors, "a") if errors else subprocess.STDOUT
    return subprocess.Popen(command, stdout=open(log or os.devnull, "a"), stderr=errors, start_new_session=True)


def lines(folder):
    with open(f"{folder}/pose3d.jsonl") as file:
        return [json.loads(it) for it in file]


def joints(line):
    """Returns the joints of the followed person; empty in a frame without a person."""
    return line["people"][0]["joints"] if line["people"] else {}


def position(joint):
    return joint.get("position_m")


def score(folder, truth):
    """Returns PCP3D over the limbs in all frames with a result, and the numbers of frames and limbs."""
    good = total = 0
    for line in lines(folder):
        true = truth[line["frame"]]
        for a, b in LIMBS:
            got = [position(joints(line).get(it, {})) for it in (a, b)]
            if None in got:
                continue
            limb = math.dist(true[a], true[b])
            total += 1
            good += sum(math.dist(g, true[it]) for g, it in zip(got, (a, b))) / 2 <= limb / 2
    return {"pcp3d": round(100 * good / max(total, 1), 2), "limbs": total}


def latency(folder):
    """Returns the median and 99th percentile of the latency from capture to result and of every stage's computing time, in ms."""
    try:
        it = json.load(open(f"{folder}/latency.json"))
    except OSError:
        return None
    both = lambda row: [round(row[key], 1) if row[key] is not None else None for key in ("p50_ms", "p99_ms")]
    return {"end_to_end": both(it["end_to_end"]), **{name: both(row) for name, row in it["stages"].items()}}


def truth_of(folder):
    rows = [json.loads(it) for it in open(f"{folder}/truth.jsonl")]
    names = rows[0]["joints"]
    return {row["frame"]: dict(zip(names, row["joints"])) for row in rows[1:]}


def state(folder):
    try:
        return json.load(open(f"{folder}/hosts.json"))
    except (OSError, ValueError):
        return None


def accounted(folder):
    """Checks that used, late, gone and left out frames add up to all frames, for every view of another host."""
    it = state(folder)
    views = [view for host in it["hosts"] for view in host["views"]]
    sums = [view["used"] + view["late"] + view["gone"] + view["left_out"] for view in views]
    return {"frames": n_frames, "sums": sums, "views": [
        {key: view[key] for key in ("view", "used", "late", "gone", "left_out", "came_late", "surplus", "overtaken")} for view in views]}


def stop(process):
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGTERM)
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)


def three(file, out, fault=None, far=("left", "right"), records=False):
    """Runs a deployment on several hosts; `fault(out, processes)` is called when all views have arrived."""
    os.makedirs(out, exist_ok=True)
    log = f"{out}/log"
    recording = lambda name: f"{out}/{name}.mcap" if records else None
    desk = run(file, out, "--host", "desk", ns="desk", log=log, record=recording("desk"))
    start = lambda name: run(file, out, "--host", name, ns=name, clock=CLOCKS[name], log=f"{out}/log-{name}", record=recording(name))
    processes = {"desk": desk, **{name: start(name) for name in far}}
    processes["start"] = start
    begin = time.time()
    try:
        while fault and time.time() - begin < 60:
            now = state(out)
            if now and all(host["there"] and all(v["used"] > 2 for v in host["views"]) for host in now["hosts"]):
                break
            time.sleep(0.05)
        said = fault(out, processes) if fault else {}
        status = desk.wait(seconds * 3 + 120)
    finally:
        for name in (*far, "desk"):
            stop(processes[name])
    return {"exit": status, **said}


def used(folder, host):
    it = state(folder)
    return sum(view["used"] for other in it["hosts"] if other["name"] == host for view in other["views"])


def watch(folder, host, restore, after):
    """Returns the time from a fault until the host counts as gone, and from the end of the fault until messages are used again."""
    begin, gone, back, restored, n = time.time(), None, None, None, None
    while time.time() - begin < after + 40:
        now = state(folder)
        there = now and all(it["there"] for it in now["hosts"] if it["name"] == host)
        if gone is None and now and not there:
            gone = time.time() - begin
        if restored is None and time.time() - begin >= after:
            n = used(folder, host)
            restore()
            restored = time.time()
        if restored and used(folder, host) > n + 1:
            back = time.time() - restored
            break
        if now and now["over"]:
            break
        time.sleep(0.03)
    return {"gone_s": gone and round(gone, 2), "back_s": back and round(back, 2)}


def cable(seconds):
    def fault(folder, _):
        sh("ip", "link", "set", "px-left", "down")
        return watch(folder, "left", lambda: sh("ip", "link", "set", "px-left", "up"), seconds)
    return fault


def for_ever(folder, _):
    sh("ip", "link", "set", "px-left", "down")
    return {}


def loss(percent):
    def fault(folder, _):
        rules = ("add table inet px; add chain inet px in { type filter hook input priority 0 ; }; "
                 f"add rule inet px in numgen random mod 100 < {percent} drop")
        sh("ip", "netns", "exec", "px-desk", "nft", rules)
        return {}
    return fault


def slow(kbit):
    def fault(folder, _):
        sh("ip", "netns", "exec", "px-left", "tc", "qdisc", "add", "dev", "eth0", "root", "tbf", "rate", f"{kbit}kbit",
           "burst", "16kb", "latency", "200ms")
        return {}
    return fault


def kill_host(folder, processes):
    os.killpg(processes["left"].pid, signal.SIGKILL)

    def restore():
        processes["left"] = processes["start"]("left")
    return watch(folder, "left", restore, 3)


def kills(folder, processes):
    """Kills hosts repeatedly, each while the link is in use."""
    begin, all = time.time(), []
    while processes["desk"].poll() is None and time.time() - begin < seconds - 20:
        all.append(kill_host(folder, processes))
        time.sleep(2)
    return {"kills": len(all), "came_back": sum(it["back_s"] is not None for it in all)}


def died(folder):
    """Returns the processes of the fusing host that died."""
    return sum(" ended by signal " in line for line in open(f"{folder}/log"))


def descendants(roots):
    """Returns all descendants of these processes."""
    below, parents = set(roots), {}
    for name in os.listdir("/proc"):
        if name.isdigit():
            try:
                parents[int(name)] = int(open(f"/proc/{name}/stat").read().rsplit(")", 1)[1].split()[1])
            except (OSError, IndexError):
                pass
    while more := {it for it, parent in parents.items() if parent in below} - below:
        below |= more
    return below


def held(roots):
    """Returns the memory (proportional share, MB), descriptors and threads, by process name."""
    sums = {}
    for it in descendants(roots):
        try:
            words = open(f"/proc/{it}/cmdline").read().split("\0")
            if os.path.basename(words[0]) != os.path.basename(parallax):
                continue
            pss = next(int(line.split()[1]) for line in open(f"/proc/{it}/smaps_rollup") if line.startswith("Pss:")) / 1024
            threads = len(os.listdir(f"/proc/{it}/task"))
            row = sums.setdefault(words[1], {"processes": 0, "mb": 0.0, "descriptors": 0, "threads": 0})
            row["processes"] += 1
            row["mb"] = round(row["mb"] + pss, 1)
            row["descriptors"] += len(os.listdir(f"/proc/{it}/fd"))
            row["threads"] += threads
        except (OSError, StopIteration, IndexError):
            pass
    return sums


def endurance(folder, processes):
    """Cuts links and kills hosts at random until the run ends. Records the resources of the fusing host every half minute."""
    dice, begin, next_sample = random.Random(1), time.time(), 0.0
    faults, samples = [], open(f"{folder}/held.jsonl", "a", buffering=1)
    held_now = {}
    while processes["desk"].poll() is None and time.time() - begin < seconds - 90:
        host, kind = dice.choice(["left", "right"]), dice.choice(["cut", "cut", "cut", "cut", "kill"])
        length, calm = dice.uniform(0.5, 20.0), dice.uniform(10.0, 50.0)
        end = time.time() + calm
        while time.time() < end:
            if time.time() >= next_sample:
                next_sample = time.time() + 30
                held_now = held([processes["desk"].pid])
                samples.write(json.dumps({"s": round(time.time() - begin), "held": held_now}) + "\n")
            time.sleep(0.5)
        if kind == "cut":
            sh("ip", "link", "set", f"px-{host}", "down")
            restore = lambda: sh("ip", "link", "set", f"px-{host}", "up")
        else:
            os.killpg(processes[host].pid, signal.SIGKILL)

            def restore():
                processes[host] = processes["start"](host)
        it = watch(folder, host, restore, length)
        faults.append({"host": host, "kind": kind, "length_s": round(length, 1), **it})
        with open(f"{folder}/faults.jsonl", "a") as file:
            file.write(json.dumps(faults[-1]) + "\n")
    rows = [json.loads(it) for it in open(f"{folder}/held.jsonl")]
    rows = [it["held"] for it in rows if it["s"] > 120] or [held_now]
    # Growth is the difference between the last and the first quarter.
    quarter = max(len(rows) // 4, 1)
    total = lambda row, key: sum(it[key] for it in row.values())
    mean = lambda part, key: round(sum(total(it, key) for it in part) / len(part), 1)
    flat = {key: [mean(rows[:quarter], key), mean(rows[-quarter:], key)] for key in ("processes", "mb", "descriptors", "threads")}
    back = sorted(it["back_s"] for it in faults if it["back_s"] is not None)
    return {"faults": len(faults), "kills": sum(it["kind"] == "kill" for it in faults), "came_back": len(back),
            "back_p50_s": back and back[len(back) // 2], "back_max_s": back and back[-1], "first_and_last_quarter": flat}


def processor_s(roots):
    """Returns the processor time of all descendants of these processes, in seconds."""
    tick, total = os.sysconf("SC_CLK_TCK"), 0
    for it in descendants(roots):
        try:
            words = open(f"/proc/{it}/stat").read().rsplit(")", 1)[1].split()
            total += int(words[11]) + int(words[12])
        except (OSError, IndexError):
            pass
    return total / tick


def busy(folder, processes):
    """Returns the number of cores that each host uses, from the arrival of all views until a few frames before the end."""
    hosts = [it for it in processes if it != "start"]
    spent = lambda: {it: processor_s([processes[it].pid]) for it in hosts}
    before, begin = spent(), time.time()
    time.sleep(max(seconds - 15, 5))
    after, took = spent(), time.time() - begin
    return {"cores": {it: round((after[it] - before[it]) / took, 3) for it in hosts}}


def model(data):
    """Compares the forecast of `parallax-lab simulate hosts`, from the costs of a run on one host, with runs on two and three hosts."""
    near = n_cameras // 2
    for n_hosts, file, far in ((2, "two", ["left"]), (3, "hosts", ["left", "right"])):
        folder = f"{out}/model-{n_hosts}"
        # All hosts share the cores of one machine.
        cores = max(len(os.sched_getaffinity(0)) / n_hosts, 1)
        said = three(f"{data}/{file}.toml", folder, busy, far)
        it = state(folder)
        views = [view for host in it["hosts"] for view in host["views"]]
        # The costs of the codec and the link are taken from the run on several hosts.
        frame = sum(view["bytes"] for view in views) / max(sum(view["used"] for view in views), 1)
        median = lambda key: sum(view[key]["p50_ms"] for view in views) / len(views)
        told = [f"--{'pose' if carry == 'poses' else 'frame'}-bytes", str(frame)]
        if carry == "frames":
            told += ["--encode-ms", str(median("encode")), "--decode-ms", str(median("decode"))]
        got = json.loads(sh(parallax, "simulate", "hosts", "--report", f"{out}/one.json", "--cameras", str(n_cameras), "--hosts",
                            str(n_hosts), "--near", str(near), "--cores", str(cores), "--rate", str(rate), "--json", *told).stdout)
        row = next(row for row in got["rows"] if row["load"]["with_poses"] == (carry == "poses"))["forecast"]
        far_cores = max(said["cores"][name] for name in far)
        say(f"model-{n_hosts}", **said, measured={"cores": [said["cores"]["desk"], far_cores],
            "mb_s": round(sum(view["bytes"] for view in views) / it["seconds"] / 1e6, 3), "latency_ms": latency(folder)["end_to_end"][0]},
            forecast={"cores": [round(it, 3) for it in row["cores"]], "mb_s": round(row["bytes_s"][0] / 1e6, 3),
                      "latency_ms": round(row["latency_ms"], 1)}, costs=got["costs"])


def record(data, truth):
    """Records on the hosts. The fusing host records all messages that reach it; a host with cameras records its own views."""
    folder = f"{out}/record"
    said = three(f"{data}/hosts.toml", folder, records=True)
    from_stage = "fuse" if carry == "poses" else "pose"
    again = sh(parallax, "replay", f"{folder}/desk.mcap", "--from", from_stage, "--out", f"{folder}/again", "--set", "capture.mode=lossless", check=False)
    far = sh(parallax, "replay", f"{folder}/left.mcap", "--from", "pose", "--out", f"{folder}/far", check=False)
    say("record", **said, **score(folder, truth), replayed={"exit": again.returncode, **score(f"{folder}/again", truth)},
        far={"exit": far.returncode, "said": far.stderr.strip().splitlines()[-2:]},
        mb={name: round(os.path.getsize(f"{folder}/{name}.mcap") / 1e6, 1) for name in ("desk", "left", "right")})


def clear():
    sh("ip", "link", "set", "px-left", "up")
    sh("ip", "netns", "exec", "px-desk", "nft", "flush", "ruleset", check=False)
    sh("ip", "netns", "exec", "px-left", "tc", "qdisc", "del", "dev", "eth0", "root", check=False)


def main():
    data = f"{out}/data"
    # Tests a deployment without keys, for builds and networks that do not use them.
    keys = None if os.environ.get("INSECURE") else f"{out}/keys"
    write(data, keys)
    truth = truth_of(data)
    if keys:
        sh(parallax, "hosts", "keys", f"{data}/hosts.toml")
    wanted = os.environ.get("PARTS", "one,three,cut-1,cut-10,cut,loss-1,loss-10,slow,kill,thief").split(",")
    if "one" in wanted:
        one = run(f"{data}/one.toml", f"{out}/one", "--quiet", "--json", log=f"{out}/one.json", errors=f"{out}/one.log")
        said = {}
        if "model" in wanted:
            time.sleep(5)
            said = busy(f"{out}/one", {"one": one})
        status = one.wait(seconds * 3 + 120)
        say("one", exit=status, **said, **score(f"{out}/one", truth), latency=latency(f"{out}/one"))
    parts = {"three": None, "cut-1": cable(1), "cut-10": cable(10), "cut": for_ever, "loss-1": loss(1), "loss-10": loss(10),
             "slow": slow(int(os.environ.get("KBIT", "200"))), "kill": kill_host, "kills": kills, "endurance": endurance}
    for part, fault in parts.items():
        if part not in wanted:
            continue
        folder = f"{out}/{part}"
        said = three(f"{data}/hosts.toml", folder, fault)
        clear()
        it = state(folder)
        link = [{key: view[key] for key in ("view", "bytes", "encode", "network", "decode", "all")} for host in it["hosts"] for view in host["views"]]
        clocks = {host["name"]: host["clock"] for host in it["hosts"]}
        say(part, **said, died=died(folder), **score(folder, truth), latency=latency(folder), accounted=accounted(folder), link=link, clocks=clocks, seconds=round(it["seconds"], 1))
    if "record" in wanted:
        record(data, truth)
    if "model" in wanted:
        model(data)
    if "thief" in wanted and keys:
        thief(data)


def thief(data):
    """Checks that a host with keys from another authority and a host without keys are both refused."""
    text = open(f"{data}/hosts.toml").read()
    open(f"{data}/thief.toml", "w").write(re.sub(r'keys = ".*"', f'keys = "{out}/keys-thief"', text))
    open(f"{data}/open.toml", "w").write(re.sub(r'keys = ".*"', "insecure = true", text))
    sh(parallax, "hosts", "keys", f"{data}/thief.toml")

    def fault(folder, _):
        got = {}
        for name in ("thief", "open"):
            it = run(f"{data}/{name}.toml", f"{out}/thief-out", "--host", "left", ns="thief", log=f"{out}/thief-{name}.log")
            time.sleep(8)
            got[name] = "still waits" if it.poll() is None else f"exit {it.returncode}"
            stop(it)
        return got
    said = three(f"{data}/hosts.toml", f"{out}/thief", fault)
    say("thief", **said, accounted=accounted(f"{out}/thief"))


main()
