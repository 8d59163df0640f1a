//! Report on a training.

use core::fmt::Write as _;
use core::time::Duration;
use std::collections::BTreeMap;

use fmp::Model;
use serde_json::{Value, json};
use training::Plan;

use super::alarms::Alarms;
use super::album::Gallery;
use super::data::Data;

/// All counts of a training.
#[derive(Debug)]
pub struct Report {
    left_out: BTreeMap<&'static str, usize>,
    /// Number of people with valid labels.
    n_sound: usize,
    /// Number of people with valid labels who are large enough for training.
    n_people: usize,
    /// Number of images of people for training, including rotated and mirrored copies.
    n_images: usize,
    n_negatives: usize,
    n_unreadable: usize,
    filter_cells: usize,
    n_parts: usize,
    n_filters: usize,
    threshold: f64,
    training_seconds: f64,
    /// Number of steps done earlier, by a process that was interrupted.
    pub(super) n_resumed: usize,
    /// Total number of steps.
    pub(super) n_steps: usize,
    /// Number of images of people in which the final model found no position.
    pub(super) n_lost: Option<usize>,
    /// False alarms.
    pub(super) alarms: Option<Alarms>,
    /// Total time, in seconds.
    pub(super) seconds: f64,
}

impl Report {
    /// Returns the report with the counts that are known before the training.
    pub(super) fn new(data: &Data, gallery: &Gallery, plan: &Plan) -> Self {
        let copies = (0..plan.n_people()).map(|i| gallery.person_of(plan.person(i)));
        let mut people: Vec<usize> = copies.collect();
        people.dedup();
        let shape = plan.shape();
        let n_parts = shape.n_parts();
        Self {
            left_out: data.left_out.clone(),
            n_sound: data.people.len(),
            n_people: people.len(),
            n_images: plan.n_people(),
            n_negatives: data.negatives.len(),
            n_unreadable: data.n_unreadable,
            filter_cells: shape.side,
            n_parts,
            n_filters: (0..n_parts).map(|i| shape.n_types(i)).sum(),
            threshold: f64::NAN,
            training_seconds: 0.0,
            n_resumed: 0,
            n_steps: 0,
            n_lost: None,
            alarms: None,
            seconds: 0.0,
        }
    }

    /// Adds the trained model to the report.
    pub(super) fn trained(&mut self, model: &Model, elapsed: Duration) {
        self.threshold = model.spec().threshold;
        self.training_seconds = elapsed.as_secs_f64();
    }

    fn n_left_out(&self) -> usize {
        self.left_out.values().sum()
    }

    fn n_small(&self) -> usize {
        self.n_sound - self.n_people
    }

    /// Describes the training data in a line of text.
    pub(super) fn data_text(&self) -> String {
        format!(
            "{} people in {} images ({} left out, {} too small), {} negatives ({} unreadable); {} \
             parts, {} filters of {side}x{side} cells",
            self.n_people,
            self.n_images,
            self.n_left_out(),
            self.n_small(),
            self.n_negatives,
            self.n_unreadable,
            self.n_parts,
            self.n_filters,
            side = self.filter_cells,
        )
    }

    /// Describes the training data as JSON.
    pub(super) fn data_json(&self) -> Value {
        json!({
            "people": self.n_people,
            "images": self.n_images,
            "left_out": self.left_out,
            "small": self.n_small(),
            "negatives": self.n_negatives,
            "unreadable": self.n_unreadable,
            "parts": self.n_parts,
            "filters": self.n_filters,
            "filter_cells": self.filter_cells,
        })
    }

    /// Returns the report as text.
    pub fn text(&self) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _infallible = self.write(&mut text);
        text.trim_end().to_owned()
    }

    fn write(&self, text: &mut String) -> core::fmt::Result {
        writeln!(
            text,
            "people        {} used, in {} images including rotated and mirrored ones",
            self.n_people, self.n_images
        )?;
        let reasons: Vec<String> =
            self.left_out.iter().map(|(kind, n)| format!("{kind} {n}")).collect();
        let n_left_out = self.n_left_out();
        if reasons.is_empty() {
            writeln!(text, "  left out    0")?;
        } else {
            writeln!(text, "  left out    {n_left_out}: {}", reasons.join(", "))?;
        }
        writeln!(text, "  too small   {}", self.n_small())?;
        if let Some(n_lost) = self.n_lost {
            writeln!(
                text,
                "  lost        {n_lost} images in which the model could not be placed"
            )?;
        }
        writeln!(
            text,
            "negatives     {} used, {} unreadable",
            self.n_negatives, self.n_unreadable
        )?;
        let before = match self.n_resumed {
            0 => String::new(),
            n => format!(", {n} of them before the interruption"),
        };
        writeln!(
            text,
            "steps         {}{before}; {:.1} s",
            self.n_steps, self.training_seconds
        )?;
        let side = self.filter_cells;
        writeln!(
            text,
            "model         {} parts, {} filters of {side}x{side} cells, threshold {:.4}",
            self.n_parts, self.n_filters, self.threshold
        )?;
        if let Some(alarms) = &self.alarms {
            writeln!(text, "false alarms  {}", alarms.text())?;
        }
        if let Some(bytes) = runtime::peak_memory() {
            writeln!(text, "memory        {:.0} MB at most", bytes as f64 / 1e6)?;
        }
        writeln!(text, "time          {:.1} s", self.seconds)
    }

    /// Returns the report as JSON.
    pub fn json(&self) -> Value {
        json!({
            "event": "summary",
            "schema_version": 1,
            "data": self.data_json(),
            "lost": self.n_lost,
            "steps": self.n_steps,
            "steps_before": self.n_resumed,
            "training_seconds": self.training_seconds,
            "seconds": self.seconds,
            "threshold": self.threshold,
            "peak_memory_bytes": runtime::peak_memory(),
            "false_alarms": self.alarms.as_ref().map(Alarms::json),
        })
    }
}
