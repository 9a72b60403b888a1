"""Tests of remarks: times in another unit are noticed at once, and other files are named."""

import time

import numpy as np
import pytest
from bad_files import complaint, evt2, evt3

from bicode_lab.events import make_events
from bicode_lab.recordings import open_recording
from bicode_lab.recordings.remarks import remark_on_clock


def blinking(n=3000, step_us=10):
    return make_events(np.full(n, 5), np.full(n, 5), np.arange(n) % 2, step_us * np.arange(n))


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (
            1000,
            "3,000 events in 29.99 s: nothing blinks at such a rate; every time is a multiple of 1,000: are they ns",
        ),
        (777, "3,000 events in 23.3 s: nothing blinks at such a rate; are the times in microseconds?"),
        (1, ""),
        (
            0.001,
            "3,000 events in 2.9e-05 s: more than most cameras can send; are the times in microseconds, or in ms or s?",
        ),
    ],
)
def test_times_in_another_unit(tmp_path, factor, words):
    events = blinking()
    np.savez(tmp_path / "a.npz", x=events["x"], y=events["y"], p=events["p"], t=(events["t"] * factor).astype(np.int64))
    recording = open_recording(tmp_path / "a.npz")
    started = time.perf_counter()
    next(iter(recording))
    assert time.perf_counter() - started < 5, "the remark is there with the first chunk"
    assert [line[: len(words)] for line in recording.remarks] == ([words] if words else [])


def test_few_events_are_not_judged():
    assert remark_on_clock(blinking(999, 100_000)) == ""
    assert remark_on_clock(blinking(1000, 100_000)) != ""
    assert remark_on_clock(blinking(1000, 2100)).endswith("are the times in microseconds?")
    assert remark_on_clock(blinking(1000, 1950)) == "", "500 events/s may be a quiet scene"


def test_words_of_the_vendors_own_kind_are_passed_over_and_counted(tmp_path):
    good = (0x8001, 0x0005, 0x2001)
    for content in (evt3(*good, 0x9999, 0x9123, 0x2002), evt2(0x80000001, 5, 0x99999999, 0x90000000, 7)):
        (tmp_path / "a.raw").write_bytes(content)
        for lenient in (False, True):
            recording = open_recording(tmp_path / "a.raw", lenient=lenient)
            assert recording.read().size == 2
            assert recording.dropped == {}
            assert recording.remarks == [
                "2 words of the vendor's own kind 9 were passed over (some cameras pad their data)"
            ]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (
            b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 8\n",
            "a pointer of git LFS, not the recording; ",
        ),
        (
            b"../.git/annex/objects/xQ/MD5E-s8--0.raw/MD5E-s8--0.raw",
            "a pointer of git-annex, not the recording; fetch it",
        ),
        (b"/annex/objects/MD5E-s8--0.raw\n", "a pointer of git-annex, not the recording; fetch it"),
        (b"\n<!DOCTYPE html><html>", "a web page, not the recording; download the file itself"),
        (b"<?xml version='1.0'?>", "an XML document; give EVT2"),
        (b"\x1f\x8b\x08", "a gzip archive; unpack it first"),
        (b"BZh91AY", "a bzip2 archive; unpack it first"),
        (b"\xfd7zXZ\0", "an xz archive; unpack it first"),
        (b"\x28\xb5\x2f\xfd", "a zstd archive; unpack it first"),
        (b"7z\xbc\xaf\x27\x1c", "a 7z archive; unpack it first"),
        (b"Rar!\x1a\x07", "a RAR archive; unpack it first"),
        (bytes(257) + b"ustar\0", "a tar archive; unpack it first"),
        (b"\0\0\0\x18ftypmp42", "a video (MP4), not events; give EVT2"),
        (b"RIFF\0\0\0\0AVI LIST", "a video (AVI), not events; give EVT2"),
        (b"\x80\x04\x95", "a Python pickle, which is not opened because it can run any program; save it as npz"),
        (b"#ROSBAG V1.2\n", "a ROS bag of version 1; convert it with: rosbag fix"),
        (b"ARROW1\0\0", "an Arrow file; save it as Parquet"),
    ],
)
def test_other_files_are_named(tmp_path, content, words):
    assert complaint(tmp_path / "a.raw", content + bytes(9)).startswith(f"not an event file but {words}")
