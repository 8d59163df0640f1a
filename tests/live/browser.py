"""A headless Chromium controlled by tests, and footage that is light enough for a busy machine. Used by tests/live/view and
scripts/bench-view."""
import base64, json, os, re, shutil, subprocess, sys, time


def program():
    """Returns the browser of this machine, if there is one."""
    return next(filter(None, map(shutil.which, ["chromium", "chromium-browser", "google-chrome"])), None)


class Browser:
    """A headless Chromium, controlled through a pipe."""

    def __init__(self, program, folder):
        to, self.out = os.pipe()
        self.into, back = os.pipe()
        def give():
            # First duplicates the descriptors to numbers other than 3 and 4, which the browser uses.
            os.dup2(to, 103); os.dup2(back, 104); os.dup2(103, 3); os.dup2(104, 4)
        flags = ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run",
                 "--remote-debugging-pipe", f"--user-data-dir={folder}", "--disable-dev-shm-usage"]
        self.child = subprocess.Popen([program, *flags, "about:blank"], close_fds=False, preexec_fn=give,
                                      stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(to); os.close(back)
        self.n, self.waiting, self.targets = 0, b"", []

    def ask(self, method, session=None, **params):
        self.n += 1
        message = {"id": self.n, "method": method, "params": params}
        if session:
            message["sessionId"] = session
        os.write(self.out, json.dumps(message).encode() + b"\0")
        while True:
            while b"\0" not in self.waiting:
                more = os.read(self.into, 1 << 20)
                if not more:
                    sys.exit("failed: the browser has ended")
                self.waiting += more
            text, self.waiting = self.waiting.split(b"\0", 1)
            answer = json.loads(text)
            if answer.get("id") == self.n:
                if "error" in answer:
                    sys.exit(f"failed: {method}: {answer['error']}")
                return answer["result"]

    def page(self, url, width=1280, height=720, scheme="light", own_window=False):
        """* own_window: opens a new window. In one window, only one page is visible at a time."""
        target = self.ask("Target.createTarget", url="about:blank", newWindow=own_window)["targetId"]
        self.targets.append(target)
        session = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        page = Page(self, session)
        page.ask("Page.enable"); page.ask("Runtime.enable")
        page.look(width, height, scheme)
        page.ask("Page.navigate", url=url)
        return page

    def close_pages(self):
        while self.targets:
            self.ask("Target.closeTarget", targetId=self.targets.pop())

    def close(self):
        self.child.kill(); self.child.wait()


class Page:
    def __init__(self, browser, session):
        self.browser, self.session = browser, session

    def ask(self, method, **params):
        return self.browser.ask(method, self.session, **params)

    def look(self, width, height, scheme):
        self.ask("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=width < 500)
        self.ask("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])

    def js(self, text):
        result = self.ask("Runtime.evaluate", expression=text, returnByValue=True)
        if "exceptionDetails" in result:
            sys.exit(f"failed: {text}: {result['exceptionDetails']}")
        return result["result"].get("value")

    def counts(self):
        return json.loads(self.js("document.documentElement?.dataset.counts") or "{}")

    def until(self, what, holds, limit=60):
        begin = time.monotonic()
        while time.monotonic() - begin < limit:
            got = holds()
            if got:
                return got
            time.sleep(0.1)
        sys.exit(f"failed: no {what} within {limit} s; the page says {self.js('document.body.innerText')!r}")

    def key(self, key):
        text = {"text": key} if len(key) == 1 else {}
        self.ask("Input.dispatchKeyEvent", type="keyDown", key=key, **text)
        self.ask("Input.dispatchKeyEvent", type="keyUp", key=key)

    def shot(self, file, whole=False):
        data = self.ask("Page.captureScreenshot", format="png", captureBeyondViewport=whole)["data"]
        with open(file, "wb") as out:
            out.write(base64.b64decode(data))


def children_of(parent):
    """Returns the command lines of all descendants of a process, by process id."""
    found = {}
    for pid in filter(str.isdigit, os.listdir("/proc")):
        try:
            stat = open(f"/proc/{pid}/stat").read().rsplit(")", 1)[1].split()
            found[int(pid)] = int(stat[1]), open(f"/proc/{pid}/cmdline").read().split("\0")
        except OSError:
            continue
    below, more = {}, {parent}
    while more:
        more = {pid for pid, (above, _) in found.items() if above in more and pid not in below}
        below |= {pid: found[pid][1] for pid in more}
    return below


def seconds_of(pid):
    """Returns the processor time that a process has used, in seconds."""
    try:
        stat = open(f"/proc/{pid}/stat").read().rsplit(")", 1)[1].split()
    except OSError:
        return 0
    return (int(stat[11]) + int(stat[12])) / os.sysconf("SC_CLK_TCK")


# Indices of the joints of people.jsonl among the 26 keypoints of Halpe.
HALPE = [16, 14, 12, 11, 13, 15, 10, 8, 6, 5, 7, 9, 18, 17]
N_DRAWN = 60


def footage(parallax, folder, seconds, rate):
    """Makes a deployment of four cameras around a synthetic person with known keypoints, light enough for a busy machine.
    The pictures are played forwards and backwards as often as necessary."""
    subprocess.run([f"{parallax}-lab", "synth", f"{folder}.rig", "--rig", "ring:4", "--live", "--quiet"], check=True)
    rig = open(f"{folder}.rig/rig.toml").read()
    for name, by in [("size_px", lambda it: it // 2), ("focal_px", lambda it: it / 2), ("principal_point_px", lambda it: (it - 0.5) / 2)]:
        halve = lambda found: f"{name} = {[by(it) for it in json.loads(found[1])]}"
        rig = re.sub(name + r" = (\[.*\])", halve, rig)
    with open(f"{folder}.toml", "w") as out:
        out.write(rig)
    subprocess.run([f"{parallax}-lab", "synth", folder, "--rig", out.name, "--frames", str(N_DRAWN), "--rate", str(rate), "--no-masks",
                    "--format", "jpg", "--quiet"], check=True)
    people = {}
    for line in map(json.loads, open(f"{folder}/people.jsonl")):
        people[line["image"]] = line["joints"]
    text = f'name = "view-{os.getpid()}"\nrig = "rig.toml"\noutput = "out"\n[capture]\nframe_rate_hz = {rate}\n' \
        'mode = "realtime"\n'
    for camera in sorted(os.listdir(f"{folder}/cameras")):
        shown, found = f"{folder}/shown/{camera}", f"{folder}/found/{camera}"
        os.makedirs(shown); os.makedirs(found)
        for frame in range(int(seconds * rate)):
            drawn = frame % (2 * N_DRAWN - 2)
            drawn = min(drawn, 2 * N_DRAWN - 2 - drawn)
            name = f"cameras/{camera}/{drawn:06}.jpg"
            os.symlink(f"{folder}/{name}", f"{shown}/{frame:06}.jpg")
            keypoints = [0] * 78
            for joint, (x, y) in enumerate(people[name]):
                keypoints[3 * HALPE[joint]:3 * HALPE[joint] + 3] = [x, y, 0.9]
            with open(f"{found}/{frame:06}_keypoints.json", "w") as out:
                json.dump({"people": [{"pose_keypoints_2d": keypoints}]}, out)
        text += f'[[camera]]\nname = "{camera}"\nsource = "shown/{camera}"\nkeypoints = "found/{camera}"\nkeypoint_names = "halpe-26"\n'
    with open(f"{folder}/deployment.toml", "w") as out:
        out.write(text)
    return out.name
