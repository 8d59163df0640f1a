"""What programs of others read in a folder of exports, as one line of JSON: a name for each package, null where Python lacks it."""
import importlib.util
import json
import math
import sys

FOLDER = sys.argv[1] + "/"


def or_none(point):
    return [float(it) for it in point] if all(math.isfinite(it) for it in point) else None


def c3d():
    import ezc3d

    file = ezc3d.c3d(FOLDER + "pose3d.c3d")
    points = file["data"]["points"][:3] / 1000
    frames = [[or_none(points[:, joint, frame]) for joint in range(points.shape[1])] for frame in range(points.shape[2])]
    parameters = file["parameters"]["POINT"]
    return {"points": frames, "rate": parameters["RATE"]["value"][0], "units": parameters["UNITS"]["value"][0],
            "joints": parameters["LABELS"]["value"]}


def long():
    """A C3D file with more frames than 16 bits count: how many there are, and the last one."""
    import ezc3d

    points = ezc3d.c3d(FOLDER + "long.c3d")["data"]["points"][:3]
    return {"frames": points.shape[2], "last": or_none(points[:, 0, -1])}


def trc():
    """y up, as OpenSim has it, back to z up."""
    import opensim

    table = opensim.TimeSeriesTableVec3(FOLDER + "pose3d.trc")
    rows = [table.getRowAtIndex(it) for it in range(table.getNumRows())]
    points = [[[row[it][axis] for axis in (2, 0, 1)] for it in range(row.ncol())] for row in rows]
    return {"points": [[or_none(it) for it in frame] for frame in points],
            "joints": [it.replace("_", " ") for it in table.getColumnLabels()]}


def hierarchy():
    import bvh

    animation = bvh.Bvh(open(FOLDER + "pose3d.bvh").read())
    names = animation.get_joints_names()
    numbers = [value for frame in range(animation.nframes) for name in names
               for value in animation.frame_joint_channels(frame, name, animation.joint_channels(name))]
    return {"frames": animation.nframes, "seconds": animation.frame_time, "joints": names,
            "is_finite": all(math.isfinite(it) for it in numbers)}


def scene():
    import pygltflib

    file = pygltflib.GLTF2().load_binary(FOLDER + "pose3d.glb")
    inputs = {file.accessors[it.input].count for it in file.animations[0].samplers}
    return {"animations": len(file.animations), "skins": len(file.skins), "keys": sorted(inputs),
            "bones": [file.nodes[it].name for it in file.skins[0].joints]}


def table(read):
    rows = read()
    frames = rows["frame"].unique()
    points = rows[["x_m", "y_m", "z_m"]].to_numpy().reshape(len(frames), -1, 3)
    return {"points": [[or_none(it) for it in frame] for frame in points], "joints": list(rows["joint"].unique()),
            "states": sorted(rows["status"].unique())}


def csv():
    import pandas

    return table(lambda: pandas.read_csv(FOLDER + "pose3d-long.csv"))


def parquet():
    import pandas

    return table(lambda: pandas.read_parquet(FOLDER + "pose3d.parquet"))


READERS = {"c3d": (c3d, ["ezc3d"]), "long": (long, ["ezc3d"]), "trc": (trc, ["opensim"]), "bvh": (hierarchy, ["bvh"]),
           "glb": (scene, ["pygltflib"]), "csv": (csv, ["pandas"]), "parquet": (parquet, ["pandas", "pyarrow"])}
said = {}
for name in sys.argv[2:]:
    read, packages = READERS[name]
    said[name] = read() if all(importlib.util.find_spec(it) for it in packages) else None
print(json.dumps(said))
