"""Scales a model and solves inverse kinematics with OpenSim, and prints the distances of the markers in mm as JSON.

usage: kinematics.py FOLDER [MODEL]

FOLDER is an `opensim` export. MODEL is a full-body model; without it, the model of the package `pose2sim` is used.
Without OpenSim or a model, it prints `null`.
"""

import json
import os
import shutil
import sys
from importlib.util import find_spec


def model():
    if len(sys.argv) > 2:
        return sys.argv[2]
    found = find_spec("Pose2Sim")
    folder = found and list(found.submodule_search_locations)[0]
    return folder and os.path.join(folder, "OpenSim_Setup", "Model_Pose2Sim_simple.osim")


def main():
    source = model()
    if find_spec("opensim") is None or not source:
        print("null")
        return
    source = os.path.abspath(source)
    os.chdir(sys.argv[1])
    import opensim

    opensim.ModelVisualizer.addDirToGeometrySearchPaths(os.path.join(os.path.dirname(source), "Geometry"))
    shutil.copy(source, "model.osim")
    opensim.ScaleTool("scaling.xml").run()  # returns False, because no markers are moved
    if not opensim.InverseKinematicsTool("kinematics.xml").run():
        sys.exit("OpenSim failed")
    table = opensim.TimeSeriesTable("kinematics_ik_marker_errors.sto")
    rms, largest = (
        [1e3 * value for value in table.getDependentColumn(name).to_numpy()]
        for name in ("marker_error_RMS", "marker_error_max")
    )
    # On a line of its own: OpenSim logs to the same stream.
    print("\n" + json.dumps({"frames": len(rms), "rms": sum(rms) / len(rms), "largest": max(largest)}), flush=True)


main()
