"""Tests of the layouts, without a deployment."""

import subprocess

import numpy as np
import pytest

from parallax_client import TOPICS, VersionMismatch, dtype, layout, place, reason


def test_every_struct_has_the_size_and_offsets_of_the_rust_definition():
    for name, struct in layout._STRUCTS.items():
        made = dtype(name)
        assert made.itemsize == struct["size"], name
        for field, _, _, offset in struct["fields"]:
            assert made.fields[field][1] == offset, (name, field)
    assert dtype("Stamp").itemsize == 32


def test_statuses_have_words():
    assert reason(0) == "ok" and reason(5) == "too few views" and reason(4_000_000_000) == "unknown"


def test_every_topic_has_a_message_with_a_type_for_the_transport():
    for topic in TOPICS.values():
        struct = layout.ctype(topic["message"])
        assert struct.type_name().startswith(topic["message"] + ".v")


def test_the_file_is_the_one_that_the_executable_makes(executable):
    made = subprocess.run([executable, "messages", "--json"], capture_output=True, text=True, check=True).stdout
    ours = (layout.pathlib.Path(layout.__file__).with_name("messages.json")).read_text(encoding="utf-8")
    assert made == ours


def test_another_version_is_refused_with_both_numbers(tmp_path, monkeypatch):
    monkeypatch.setattr(place, "base", lambda: tmp_path)
    folder = tmp_path / "other"
    folder.mkdir()
    (folder / "deployment.json").write_text('{"programs": {"format": 99}}')
    with pytest.raises(VersionMismatch) as error:
        place.description("other")
    assert (error.value.theirs, error.value.ours) == (99, place.DESCRIPTION_VERSION)
    assert "99" in str(error.value) and str(place.DESCRIPTION_VERSION) in str(error.value)


def test_seats_are_limited_and_free_again(tmp_path, monkeypatch):
    from parallax_client import Full

    monkeypatch.setattr(place, "base", lambda: tmp_path)
    (tmp_path / "full").mkdir()
    seats = [place.Seat("full") for _ in range(place.MOST_GUESTS)]
    with pytest.raises(Full, match=str(place.MOST_GUESTS)):
        place.Seat("full")
    seats.pop().leave()
    place.Seat("full").leave()


def test_a_message_of_garbage_is_no_message():
    from parallax_client.live import _are_skeletons

    running = {"joints": ["a"] * 14, "views": [{"name": "x"}] * 4}
    random = np.random.default_rng(1)
    for _ in range(200):
        message = random.integers(0, 256, dtype("Skeletons").itemsize, dtype=np.uint8).view(dtype("Skeletons"))[0]
        assert not _are_skeletons(message, running)
    message = np.zeros((), dtype("Skeletons"))
    assert _are_skeletons(message, running)
    message["n_people"], message["people"]["n_joints"], message["people"]["n_views"] = 2, 14, 4
    assert not _are_skeletons(message, running), "two people of one identity"
    message["people"]["id"][:2] = 1, 2
    assert _are_skeletons(message, running)
    message["people"]["joints"]["in_world"][1, 3, 1] = np.nan
    assert not _are_skeletons(message, running)
    message["n_people"] = 9
    assert not _are_skeletons(message, running)
