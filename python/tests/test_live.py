"""Tests with a real deployment of synthetic cameras, read while it runs. Skipped without the executable or iceoryx2."""

import itertools
import os
import pathlib
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import parallax_client

# Time limit in seconds, long enough for a busy machine.
PATIENCE = 300


def mapping_of(array):
    """Returns the line of /proc/self/maps that contains an array."""
    pointer = array.__array_interface__["data"][0]
    with open("/proc/self/maps", encoding="ascii") as lines:
        for line in lines:
            begin, end = (int(it, 16) for it in line.split()[0].split("-"))
            if begin <= pointer < end:
                return line
    raise AssertionError("the array is in no mapping")


def test_skeletons_poses_and_pictures_of_a_frame_come_together_and_a_process_that_dies_comes_back(deploy):
    deployment = deploy()
    with pytest.raises(parallax_client.NotRunning, match="is not running"):
        parallax_client.connect("no-such-deployment")
    # The deployment is not running yet; the client connects to it when it starts.
    with parallax_client.connect(deployment.name, poses=True, pictures=True, every=True, wait=True) as client:
        moment = next(it for it in client.moments(PATIENCE) if it.is_complete and it.people)
        assert set(moment.pictures) == set(moment.poses) == {it["name"] for it in client.running["views"]}
        for name, picture in moment.pictures.items():
            assert picture.frame == moment.frame and picture.pixels.shape == (240, 320, 3)
            assert int(moment.poses[name]["stamp"]["frame"]) == moment.frame
        joints = moment.followed.joints()
        assert len(joints) == 14
        for joint in joints.values():
            assert (joint.position is None) == (joint.reason is not None)

        # The view is read-only, in the memory of the sender, and remains valid.
        with client.picture("c1", PATIENCE) as picture:
            assert not picture.pixels.flags.writeable and not picture.pixels.flags.owndata
            with pytest.raises(ValueError):
                picture.pixels.flags.writeable = True
            assert "shm" in mapping_of(picture.pixels) or ".data" in mapping_of(picture.pixels)
            kept = picture.pixels.copy()
        assert kept.mean() > 0
        with client.latest_skeletons(PATIENCE) as sample:
            assert np.isfinite(sample.message["people"]["joints"]["in_world"]).all()

        # A killed process comes back without an error in the client.
        pid = deployment.pids("triangulate")[0]
        os.kill(pid, signal.SIGKILL)
        killed = time.monotonic_ns()
        moment = next(it for it in client.moments(PATIENCE) if it.captured_at_nanos > killed)
        assert int(moment.skeletons["stamp"]["epoch"]) == 1
        assert client.refused == 0


def test_programs_that_are_killed_or_asleep_keep_no_place_and_hold_up_nobody(deploy):
    deployment = deploy()
    words = "import parallax_client, sys, time; c = parallax_client.connect(sys.argv[1], pictures=True, wait=True); " \
            f"c.next({PATIENCE}); print('there', flush=True); time.sleep(600)"
    for _ in range(6):
        program = subprocess.Popen([sys.executable, "-c", words, deployment.name], stdout=subprocess.PIPE, text=True)
        assert program.stdout.readline() == "there\n"
        program.kill()
        program.wait()
    asleep = subprocess.Popen([sys.executable, "-c", words, deployment.name], stdout=subprocess.PIPE, text=True)
    assert asleep.stdout.readline() == "there\n"
    with parallax_client.connect(deployment.name) as client:
        frames = [client.next(PATIENCE).frame for _ in range(3)]
        assert frames == sorted(set(frames))
        # The deployment ends although one client sleeps and another is connected.
        deployment.stop()
        again = deploy(name=deployment.name)
        moment = client.next(PATIENCE)
        while moment.session != client.running["session"] or moment.frame > 50:
            moment = client.next(PATIENCE)
        assert again.process.poll() is None
    asleep.kill()
    asleep.wait()


def test_the_example_prints_a_wrist_that_moves_also_after_a_process_was_killed(deploy):
    deployment = deploy()
    example = pathlib.Path(__file__).parents[1] / "examples" / "wrist.py"
    paths = os.pathsep.join([str(example.parents[1]), os.environ.get("PYTHONPATH", "")])
    program = subprocess.Popen([sys.executable, example, deployment.name, "neck"], stdout=subprocess.PIPE, text=True,
                               env={**os.environ, "PYTHONPATH": paths})

    def places(n):
        """Returns the next positions that the program prints. They end when the deployment, and so the program, ends."""
        found = (line.split()[1:4] for line in program.stdout if " m  +-" in line)
        return {tuple(it) for it in itertools.islice(found, n)}

    try:
        assert len(places(3)) > 1
        os.kill(deployment.pids("triangulate")[0], signal.SIGKILL)
        assert len(places(5)) > 1
        deployment.stop()
        assert program.stdout.read().splitlines()[-1].split()[1:3] == ["frames", "received,"]
        assert program.wait(PATIENCE) == 0
    finally:
        program.kill()
        program.wait()


def test_there_is_a_limit_which_is_named(deploy):
    deployment = deploy()
    clients = [parallax_client.connect(deployment.name, wait=True)]
    assert clients[0].next(PATIENCE) is not None
    with pytest.raises(parallax_client.Full, match="4 programs"):
        for _ in range(20):
            clients.append(parallax_client.connect(deployment.name))
    assert len(clients) == 4
    for client in clients:
        client.close()
    parallax_client.connect(deployment.name).close()


def test_the_folder_of_a_run_is_arrays(deploy):
    deployment = deploy(seconds=10)
    deployment.process.wait(PATIENCE * 2)
    run = parallax_client.read_folder(deployment.folder / "run")
    assert run.positions.shape == (len(run.frames), 14, 3) and len(run.frames) > 10
    seen = run.status == "ok"
    assert seen.any() and np.isfinite(run.positions[seen]).any()
    assert np.isnan(run.positions[run.status == "no result"]).all()


def test_a_deployment_of_another_pid_namespace_is_read(deploy):
    within = ["unshare", "--map-current-user", "--pid", "--fork", "--mount-proc"]
    if subprocess.run([*within, "true"], capture_output=True, check=False).returncode != 0:
        pytest.skip("a pid namespace cannot be created here")
    running = deploy()
    read = (
        "import os, sys, parallax_client\n"
        "assert os.getpid() == 1, 'this is the other namespace'\n"
        "with parallax_client.connect(sys.argv[1], wait=True) as client:\n"
        f"    frame = next(client.moments(patience={PATIENCE})).frame\n"
        "    assert sys.argv[1] in parallax_client.running_deployments()\n"
        "    print(frame)\n"
    )
    ended = subprocess.run([*within, sys.executable, "-c", read, running.name], capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.strip().isdigit(), ended.stdout
