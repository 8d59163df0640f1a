//! The table of formats that are one file each.

use std::io;

use crate::sink::{Notes, Sink};
use crate::{Trial, bvh, glb, points, tables};

/// Facts of a run that a format needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Needs {
    /// How many frames a second there are.
    pub rate: bool,
    /// Which way is up.
    pub up: bool,
}

/// A format of one file.
#[derive(Debug, Clone, Copy)]
pub struct FileFormat {
    /// Its name in commands.
    pub name: &'static str,
    /// Suffix of its files after the name of the trial.
    pub suffix: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Its axes.
    pub axes: &'static str,
    /// Representation of a gap in the format.
    pub gaps: &'static str,
    /// How it holds uncertainty.
    pub uncertainty: &'static str,
    /// Facts of a run that it needs.
    pub needs: Needs,
    /// Writes a trial.
    ///
    /// # Errors
    ///
    /// Those of the writer; a trial that the format has no room for, or that has nothing of what it holds.
    pub write: fn(&Trial, &mut Sink<'_>) -> io::Result<Notes>,
}

const ALL: Needs = Needs {
    rate: true,
    up: true,
};

const NOTHING: Needs = Needs {
    rate: false,
    up: false,
};

/// All of them.
pub const FILES: &[FileFormat] = &[
    FileFormat {
        name: "c3d",
        suffix: ".c3d",
        unit: "mm",
        axes: "z up",
        gaps: "residual -1",
        uncertainty: "residual: standard deviation of the position, mm",
        needs: ALL,
        write: points::c3d,
    },
    FileFormat {
        name: "trc",
        suffix: ".trc",
        unit: "m",
        axes: "y up",
        gaps: "NaN",
        uncertainty: "none",
        needs: ALL,
        write: points::trc,
    },
    FileFormat {
        name: "glb",
        suffix: ".glb",
        unit: "m",
        axes: "y up",
        gaps: "a bone is not there: scale 0",
        uncertainty: "extras of the animation: standard deviation of every point, m",
        needs: ALL,
        write: glb::write,
    },
    FileFormat {
        name: "bvh",
        suffix: ".bvh",
        unit: "cm",
        axes: "y up",
        gaps: "the last rotation is held, and said",
        uncertainty: "none",
        needs: ALL,
        write: bvh::write,
    },
    FileFormat {
        name: "csv",
        suffix: ".csv",
        unit: "m",
        axes: "those of the rig",
        gaps: "empty cells",
        uncertainty: "standard deviation of the position, m",
        needs: NOTHING,
        write: tables::wide,
    },
    FileFormat {
        name: "csv-long",
        suffix: "-long.csv",
        unit: "m",
        axes: "those of the rig",
        gaps: "empty cells, and the reason",
        uncertainty: "covariance, m^2, and standard deviation",
        needs: NOTHING,
        write: tables::long,
    },
    #[cfg(feature = "parquet")]
    FileFormat {
        name: "parquet",
        suffix: ".parquet",
        unit: "m",
        axes: "those of the rig",
        gaps: "null, and the reason",
        uncertainty: "covariance, m^2, and standard deviation",
        needs: NOTHING,
        write: crate::parquet::write,
    },
];
