"""Tests of the folders of finished runs."""

import json

import numpy as np
import pytest

from parallax_client import ClientError, VersionMismatch, read_folder


def folder(path, version=2, joints="of-my-own", more=()):
    joint = {"position_m": [1, 2, 3], "covariance_m2": [1, 0, 0, 4, 0, 4], "reprojection_px": 1.5, "views": ["a", "b"]}
    person = {"id": 1, "status": "ok", "sides": "sure", "joints": {"head": joint, "neck": {"status": "too few views"}}}
    others = [{**person, "id": it, "joints": {"head": {**joint, "position_m": [it, 2, 3]}}} for it in more]
    lines = [
        {"frame": 0, "time_s": 0.0, "status": "ok", "people": [person]},
        {"frame": 1, "time_s": 0.5, "status": "no result", "reason": "dropped", "people": []},
        *({"frame": 2, "time_s": 1.0, "status": "ok", "people": [*others, person]} for _ in more[:1]),
    ]
    (path / "pose3d.jsonl").write_text("".join(json.dumps(it) + "\n" for it in lines))
    (path / "summary.json").write_text(json.dumps({"schema_version": version, "joints": joints}))
    return path


def test_a_folder_is_arrays_with_nan_where_there_is_nothing(tmp_path):
    run = read_folder(folder(tmp_path))
    assert run.positions.shape == (2, 2, 3)
    assert run.joint("head")[0].tolist() == [1, 2, 3]
    assert np.isnan(run.joint("neck")).all() and np.isnan(run.positions[1]).all()
    assert run.deviation[0, 0] == pytest.approx(3**0.5)
    assert run.n_views.tolist() == [[2, 0], [0, 0]]
    assert run.status.tolist() == ["ok", "no result"] and run.reason[1] == "dropped"
    with pytest.raises(KeyError, match="head, neck"):
        run.joint("tail")


def test_joints_are_in_the_order_of_their_set(tmp_path):
    run = read_folder(folder(tmp_path, joints="parse14"))
    assert len(run.joints) == 14 and run.joints[0] == "right ankle"
    assert run.joint("head")[0].tolist() == [1, 2, 3] and np.isnan(run.joint("left knee")).all()


def test_a_table_has_a_row_for_every_frame_and_joint(tmp_path):
    pytest.importorskip("pandas", reason="the package pandas is not installed")
    table = read_folder(folder(tmp_path)).to_pandas()
    assert len(table) == 4 and table["x_m"].tolist()[0] == 1 and table["x_m"].isna().sum() == 3


def test_what_is_wrong_with_a_folder_is_said(tmp_path):
    with pytest.raises(ClientError, match="is not a folder"):
        read_folder(tmp_path / "none")
    with pytest.raises(ClientError, match="not the folder of a run"):
        read_folder(tmp_path)
    folder(tmp_path, version=7)
    with pytest.raises(VersionMismatch, match="version 7.*version 2"):
        read_folder(tmp_path)
    folder(tmp_path)
    (tmp_path / "pose3d.jsonl").write_text('{"frame": 0, "status": "ok", "people": []}\n{"frame": 1, "sta')
    with pytest.raises(ClientError, match="line 2"):
        read_folder(tmp_path)
    (tmp_path / "pose3d.jsonl").write_text('{"frame": 0}\n')
    with pytest.raises(ClientError, match="missing fields: people, status"):
        read_folder(tmp_path)
    folder(tmp_path, more=range(2, 10))
    with pytest.raises(ClientError, match="line 3: the frame has 9 people, but the limit is 8"):
        read_folder(tmp_path)
    folder(tmp_path, more=[5, 5])
    with pytest.raises(ClientError, match="line 3: two people have the id 5"):
        read_folder(tmp_path)


def test_people_who_were_never_located_are_left_out(tmp_path):
    path = folder(tmp_path, more=[4]) / "pose3d.jsonl"
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    lines[2]["people"].append({"id": 9, "status": "too few views", "joints": {"head": {"status": "too few views"}}})
    path.write_text("".join(json.dumps(it) + "\n" for it in lines))
    assert list(read_folder(tmp_path).people) == [1, 4]


def test_each_of_several_people_has_arrays_of_its_own(tmp_path):
    run = read_folder(folder(tmp_path, more=[4]))
    assert list(run.people) == [1, 4]
    one, other = run.people.values()
    assert one.joint("head")[:, 0].tolist()[::2] == [1, 1] and np.isnan(one.joint("head")[1]).all()
    assert other.joint("head")[2].tolist() == [4, 2, 3] and np.isnan(other.positions[:2]).all()
    assert other.status.tolist() == [None, None, "ok"] and one.sides.tolist() == ["sure", None, "sure"]
    assert run.followed.joint("head")[2].tolist() == [4, 2, 3] and run.followed.id is None
    with pytest.raises(ClientError, match="2 people; use one of them from `people`: 1, 4"):
        run.positions
