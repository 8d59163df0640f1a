//! The table of formats with one file per trial.

use std::io;

use crate::sink::{Notes, Sink};
use crate::{Trial, bvh, glb, points, tables};

/// Properties of a run that a format needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Needs {
    /// True if the format needs the frame rate.
    pub rate: bool,
    /// True if the format needs the upward direction.
    pub up: bool,
}

/// A format with one file per trial.
#[derive(Debug, Clone, Copy)]
pub struct FileFormat {
    /// Name of the format in commands.
    pub name: &'static str,
    /// Suffix of the format's files, after the name of the trial.
    pub suffix: &'static str,
    /// Unit of lengths.
    pub unit: &'static str,
    /// Directions of the coordinate axes.
    pub axes: &'static str,
    /// Representation of a gap in the format.
    pub gaps: &'static str,
    /// Representation of uncertainty in the format.
    pub uncertainty: &'static str,
    /// Properties of a run that the format needs.
    pub needs: Needs,
    /// Writes a trial.
    ///
    /// # Errors
    ///
    /// Returns errors of the writer. Also fails if the format has no room for the trial, or if the trial has nothing that the format
    /// can store.
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

/// All formats with one file per trial.
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
        gaps: "a missing bone has scale 0",
        uncertainty: "extras of the animation: standard deviation of every point, m",
        needs: ALL,
        write: glb::write,
    },
    FileFormat {
        name: "bvh",
        suffix: ".bvh",
        unit: "cm",
        axes: "y up",
        gaps: "the last rotation is held, and a message reports this",
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
