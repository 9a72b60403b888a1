"""Make small event files of each format, byte by byte as the makers of the formats define them."""

import shutil
import struct

import h5py
import numpy as np
import pyarrow
from pyarrow import parquet
from rosbags import rosbag1, rosbag2
from rosbags.interfaces import MessageDefinition, MessageDefinitionFormat
from scipy.io import savemat

from bicode_lab.recordings import write_npz, write_recording

SIZE_PX = (346, 260)
WIDTH, HEIGHT = SIZE_PX
GEOMETRY = f"% geometry {WIDTH}x{HEIGHT}\n".encode()
FIRST_S = 1_600_000_000  # of the clock of ROS


def evt21_words(events):
    """Return events as EVT2.1 words, a vector for successive events of one row, time and polarity in 32 columns."""
    words, high, i = [], -1, 0
    rows = events.tolist()
    while i < len(rows):
        x, y, p, t = rows[i]
        if t >> 6 != high:
            high = t >> 6
            words.append((8 << 28 | high) << 32)
        bits, last = 0, x - 1
        while i < len(rows) and rows[i][1:] == (y, p, t) and last < rows[i][0] < x + 32:
            last = rows[i][0]
            bits |= 1 << last - x
            i += 1
        words.append((p << 28 | (t & 63) << 22 | x << 11 | y) << 32 | bits)
    return np.array(words, np.uint64)


def evt4_words(events):
    """Return events as EVT4 words: a vector of two words where two or more events fit into it."""
    words, high, i = [], -1, 0
    rows = events.tolist()
    while i < len(rows):
        x, y, p, t = rows[i]
        if t >> 6 != high:
            high = t >> 6
            words.append(14 << 28 | high)
        bits, last, first = 0, x - 1, i
        while i < len(rows) and rows[i][1:] == (y, p, t) and last < rows[i][0] < x + 32:
            last = rows[i][0]
            bits |= 1 << last - x
            i += 1
        place = (t & 63) << 22 | x << 11 | y
        words += [(10 + p) << 28 | place] if i == first + 1 else [(12 + p) << 28 | place, bits]
    return np.array(words, np.uint32)


def write_evt21(path, events):
    path.write_bytes(b"% format EVT21;endianness=little\n" + GEOMETRY + b"% end\n" + evt21_words(events).tobytes())


def write_evt21_swapped(path, events):
    halves = evt21_words(events).view("<u4").reshape(-1, 2)[:, ::-1]
    path.write_bytes(b"% evt 2.1\n" + GEOMETRY + halves.tobytes())


def write_evt4(path, events):
    path.write_bytes(b"% format EVT4\n" + GEOMETRY + b"% end\n" + evt4_words(events).astype("<u4").tobytes())


def dat_bytes(events, kind=b"\x0c\x08"):
    x, y, p, t = (events[name].astype(np.int64) for name in ("x", "y", "p", "t"))
    words = (t & 0xFFFFFFFF) | x << 32 | y << 46 | p << 60
    head = f"% Data file containing events.\n% Version 2\n% Width {WIDTH}\n% Height {HEIGHT}\n".encode()
    return head + kind + words.astype("<u8").tobytes()


def write_aedat2(path, events):
    """Write a file of a DAVIS346, which counts columns from the right and rows from the bottom."""
    x, y, p, t = (events[name].astype(np.int64) for name in ("x", "y", "p", "t"))
    address = (WIDTH - 1 - x) << 12 | (HEIGHT - 1 - y) << 22 | p << 11
    head = b"#!AER-DAT2.0\r\n# AEChip: eu.seebetter.ini.chips.davis.Davis346blue\r\n#End Of ASCII Header\r\n"
    path.write_bytes(head + np.stack([address, t], axis=1).astype(">u4").tobytes())


AEDAT3_HEAD = b"#!AER-DAT3.1\r\n#Format: RAW\r\n#Source 1: DAVIS346\r\n#!END-HEADER\r\n"


def aedat3_packet(rows, kind=1, room=None):
    """Return a packet of rows (32 bits of data, time); times in different turns of the clock do not share a packet."""
    turns = rows[0][1] >> 31
    head = struct.pack("<hhiiiiii", kind, 1, 8, 4, turns, room or len(rows), len(rows), len(rows))
    body = b"".join(struct.pack("<II", data, t & 0x7FFFFFFF) for data, t in rows)
    return head + body + bytes(8 * ((room or len(rows)) - len(rows)))


def write_aedat3(path, events):
    rows = [(1 | p << 1 | y << 2 | x << 17, t) for x, y, p, t in events.tolist()]
    packets = [aedat3_packet(rows[k : k + 50], room=50) for k in range(0, len(rows), 50)]
    special = aedat3_packet([(1 | 1 << 1, rows[0][1])], kind=0)  # a reset of the clock: no trigger
    path.write_bytes(AEDAT3_HEAD + special + b"".join(packets))


TRACKS = """<dv version="2.0"><node name="outInfo"><node name="0"><attr key="typeIdentifier">FRME</attr></node>
<node name="1"><attr key="typeIdentifier">EVTS</attr>
<node name="info"><attr key="sizeX">346</attr><attr key="sizeY">260</attr></node></node>
<node name="2"><attr key="typeIdentifier">TRIG</attr></node></node></dv>"""


def aedat4_head(compression=0):
    """Return the header of an AEDAT4 file: a flatbuffer with compression, end (-1: of the file) and the tracks."""
    text = TRACKS.encode()
    fields = struct.pack("<5H", 10, 24, 4, 8, 16) + bytes(2)  # sizes, then where each of the three is in the table
    table = struct.pack("<iiqI", 12, compression, -1, 8) + bytes(4) + struct.pack("<I", len(text)) + text
    buffer = struct.pack("<I", 20) + b"IOHE" + fields + table
    return b"#!AER-DAT4.0\r\n" + struct.pack("<I", len(buffer)) + buffer


def aedat4_events(events):
    """Return a packet of events, not compressed."""
    table = struct.pack("<HHHxxiI", 6, 8, 4, 8, 4) + struct.pack("<I", events.size)
    rows = np.zeros(events.size, [("t", "<i8"), ("x", "<i2"), ("y", "<i2"), ("p", "u1"), ("free", "u1", 3)])
    for name in ("t", "x", "y", "p"):
        rows[name] = events[name]
    content = struct.pack("<I", 16) + b"EVTS" + table + rows.tobytes()
    return struct.pack("<I", len(content)) + content


def aedat4_triggers(rows):
    """Return a packet of triggers (time, kind), not compressed; each is a table of its own."""
    places, tables = b"", b""
    for k, (t, kind) in enumerate(rows):
        places += struct.pack("<I", 4 * (len(rows) - k) + 24 * k + 8)
        tables += struct.pack("<4Hiqb3x", 8, 16, 4, 12, 8, t, kind)
    content = struct.pack("<I", 16) + b"TRIG" + struct.pack("<HHHxxiI", 6, 8, 4, 8, 4)
    content += struct.pack("<I", len(rows)) + places + tables
    return struct.pack("<I", len(content)) + content


def write_aedat4(path, events, triggers=(), compression=0, pack=bytes):
    """Write a file with a packet of a frame, three of events, and one of triggers where there are any."""
    packets = [(0, b"a frame")] + [(1, pack(aedat4_events(part))) for part in np.array_split(events, 3)]
    packets += [(2, pack(aedat4_triggers(triggers)))] if triggers else []
    body = b"".join(struct.pack("<iI", track, len(packet)) + packet for track, packet in packets)
    path.write_bytes(aedat4_head(compression) + body)


def write_text(path, events):
    """Write lines as the Event Camera Dataset has them: t [s] x y p."""
    path.write_text("".join(f"{t // 10**6}.{t % 10**6:06d} {x} {y} {p}\n" for x, y, p, t in events.tolist()))


def write_text_with_size(path, events):
    lines = "".join(f"{t / 1e6:.9f} {x} {y} {p}\n" for x, y, p, t in events.tolist())
    path.write_text(f"{WIDTH} {HEIGHT}\n{lines}")


def write_vendor_csv(path, events):
    lines = "".join(f"{x},{y},{p},{t}\n" for x, y, p, t in events.tolist())
    path.write_text(f"%geometry:{WIDTH},{HEIGHT}\n{lines}")


def write_csv(path, events):
    path.write_text("t,x,y,p\n" + "".join(f"{t},{x},{y},{p}\n" for x, y, p, t in events.tolist()))


def write_npy_fields(path, events):
    np.save(path, events)


def write_npy_table(path, events):
    np.save(path, np.stack([events[name].astype(np.float64) for name in ("t", "x", "y", "p")], axis=1) / [1e6, 1, 1, 1])


def write_mat(path, events):
    arrays = {name: events[name].astype(np.float64)[None] for name in ("x", "y", "p")}
    savemat(path, {**arrays, "t": events["t"][:, None], "width": WIDTH, "height": HEIGHT}, do_compression=True)


def write_mat_struct(path, events):
    savemat(path, {"TD": {"x": events["x"], "y": events["y"], "p": events["p"] * 2 - 1, "ts": events["t"]}})


def write_parquet(path, events):
    columns = {"timestamp": events["t"], "x": events["x"], "y": events["y"], "polarity": events["p"] > 0}
    parquet.write_table(pyarrow.table(columns), path)


def write_dsec(path, events, t_offset=57_922_807_541):
    with h5py.File(path, "w") as file:
        for name, kind in (("x", "u2"), ("y", "u2"), ("p", "u1")):
            file[f"events/{name}"] = events[name].astype(kind)
        file["events/t"] = (events["t"] - events["t"][0]).astype("u4")
        file["t_offset"] = np.int64(t_offset)
        file["ms_to_idx"] = np.arange(5, dtype=np.uint64)


def write_xs_ys_ts_ps(path, events):
    with h5py.File(path, "w") as file:
        file.attrs["sensor_resolution"] = (HEIGHT, WIDTH)
        group = file.create_group("events")
        group["xs"], group["ys"] = events["x"].astype("i2"), events["y"].astype("i2")
        group["ts"], group["ps"] = events["t"] / 1e6, events["p"] > 0


def write_n_by_4(path, events):
    """Write the events as MVSEC does: x, y, t [s] and the polarity +1 or -1 in four columns of one data set."""
    columns = (events["x"], events["y"], events["t"] / 1e6, events["p"] * 2.0 - 1)
    with h5py.File(path, "w") as file:
        file["davis/left/events"] = np.stack(columns, axis=1).astype(np.float64)


def write_vendor_hdf5(path, events, **how):
    with h5py.File(path, "w") as file:
        file.attrs["geometry"] = f"{WIDTH}x{HEIGHT}"
        file.create_dataset("CD/events", data=events, chunks=(64,), **how)


EVENT_ARRAY = """std_msgs/Header header
uint32 height
uint32 width
dvs_msgs/Event[] events
================================================================================
MSG: dvs_msgs/Event
uint16 x
uint16 y
time ts
bool polarity"""


def header_bytes(is_cdr):
    """Return the header of a message and the size of the sensor."""
    name = b"cam\0" if is_cdr else b"cam"
    start = b"\0\1\0\0" if is_cdr else struct.pack("<I", 7)
    return start + struct.pack("<III", FIRST_S, 5, len(name)) + name + struct.pack("<II", HEIGHT, WIDTH)


def event_array(events, is_cdr):
    """Return an EventArray, number by number; CDR puts each at a multiple of its size."""
    message = bytearray(header_bytes(is_cdr) + struct.pack("<I", events.size))
    for x, y, p, t in events.tolist():
        for kind, value in (("H", x), ("H", y), ("I", t // 10**6), ("I", t % 10**6 * 1000 + 999), ("B", p)):
            if is_cdr:
                message += bytes(-(len(message) - 4) % struct.calcsize(kind))
            message += struct.pack(f"<{kind}", value)
    return bytes(message)


def event_packet(encoding, data, time_base=0, is_cdr=True):
    """Return an EventPacket with some bytes."""
    message = bytearray(header_bytes(is_cdr))

    def add(kind, value):
        if is_cdr:
            message.extend(bytes(-(len(message) - 4) % struct.calcsize(kind)))
        message.extend(struct.pack(f"<{kind}", value))

    text = encoding.encode() + (b"\0" if is_cdr else b"")
    add("Q", 3)
    add("Q", time_base)
    add("I", len(text))
    message.extend(text)
    add("B", 0)
    add("I", len(data))
    return bytes(message) + data


def write_messages(path, messages, kind="dvs_msgs/msg/EventArray", topic="/dvs/events"):
    """Write a bag of ROS 1 (.bag), or of ROS 2 (.db3 or .mcap: the storage alone; without ending: the folder)."""
    text = MessageDefinition(MessageDefinitionFormat.MSG, EVENT_ARRAY)
    if path.suffix == ".bag":
        with rosbag1.Writer(path) as bag:
            connection = bag.add_connection(topic, kind, msgdef=EVENT_ARRAY, md5sum="5e8beee5a6c107e504c2e78903c224b8")
            for k, message in enumerate(messages):
                bag.write(connection, FIRST_S * 10**9 + k, message)
        return
    plugin = rosbag2.StoragePlugin.MCAP if path.suffix == ".mcap" else rosbag2.StoragePlugin.SQLITE3
    folder = path.with_name(f"{path.stem}_folder") if path.suffix else path
    with rosbag2.Writer(folder, version=9, storage_plugin=plugin) as bag:
        connection = bag.add_connection(topic, kind, msgdef=text.data, rihs01="RIHS01_" + "0" * 64)
        for k, message in enumerate(messages):
            bag.write(connection, FIRST_S * 10**9 + k, message)
    if path.suffix:
        next(folder.glob(f"*{path.suffix}")).rename(path)
        shutil.rmtree(folder)


def write_bag(path, events):
    parts = np.array_split(events, 3)
    write_messages(path, [event_array(part, is_cdr=path.suffix != ".bag") for part in parts])


def write_npz_file(path, events):
    write_npz(path, events, *SIZE_PX)


def write_own(path, events):
    write_recording(path, events, *SIZE_PX)


def write_dat(path, events):
    path.write_bytes(dat_bytes(events))


FILES = {
    "evt21.raw": write_evt21,
    "evt21_swapped.raw": write_evt21_swapped,
    "evt4.raw": write_evt4,
    "cd.dat": write_dat,
    "davis.aedat": write_aedat2,
    "davis31.aedat": write_aedat3,
    "dv.aedat4": write_aedat4,
    "ecd.txt": write_text,
    "size.txt": write_text_with_size,
    "vendor.csv": write_vendor_csv,
    "own.csv": write_csv,
    "fields.npy": write_npy_fields,
    "table.npy": write_npy_table,
    "own.npz": write_npz_file,
    "own.h5": write_own,
    "xs.h5": write_xs_ys_ts_ps,
    "mvsec.hdf5": write_n_by_4,
    "vendor.hdf5": write_vendor_hdf5,
    "arrays.mat": write_mat,
    "struct.mat": write_mat_struct,
    "a.parquet": write_parquet,
    "ros1.bag": write_bag,
    "ros2.db3": write_bag,
    "ros2.mcap": write_bag,
}
"""How a file of each name is written; all keep the times."""
