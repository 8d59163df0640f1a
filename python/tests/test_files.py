"""Folders of finished runs."""

import json

import numpy as np
import pytest

from parallax_client import ClientError, VersionMismatch, read_folder


def folder(path, version=1, joints="of-my-own"):
    joint = {"position_m": [1, 2, 3], "covariance_m2": [1, 0, 0, 4, 0, 4], "reprojection_px": 1.5, "views": ["a", "b"]}
    lines = [
        {"frame": 0, "time_s": 0.0, "status": "ok", "joints": {"head": joint, "neck": {"status": "too few views"}}},
        {"frame": 1, "time_s": 0.5, "status": "no result", "reason": "dropped", "joints": {}},
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
    with pytest.raises(ClientError, match="is no folder"):
        read_folder(tmp_path / "none")
    with pytest.raises(ClientError, match="no folder of a run"):
        read_folder(tmp_path)
    folder(tmp_path, version=7)
    with pytest.raises(VersionMismatch, match="version 7.*version 1"):
        read_folder(tmp_path)
    folder(tmp_path)
    (tmp_path / "pose3d.jsonl").write_text('{"frame": 0, "status": "ok", "joints": {}}\n{"frame": 1, "sta')
    with pytest.raises(ClientError, match="line 2"):
        read_folder(tmp_path)
    (tmp_path / "pose3d.jsonl").write_text('{"frame": 0}\n')
    with pytest.raises(ClientError, match="no joints, status"):
        read_folder(tmp_path)
