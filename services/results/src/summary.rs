//! Counts of results and losses over the whole run.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead as _, BufReader};
use std::path::Path;

use messages::Status;
use runfiles::{FrameLine, Missing, Summary};

use crate::calibration::Calibration;
use crate::height::Heights;
use crate::people::Counted;
use crate::pose3d::{is_placed, joints, missing};
use crate::trust::Trusted;
use crate::{FrameRecord, Scene, own};

/// Counts frame by frame.
#[derive(Debug)]
pub(crate) struct Tally {
    summary: Summary,
    squared_px: (f64, u64),
    last_frame: Option<u64>,
    n_without: u64,
    /// Number of dropped frames, by view.
    dropped: Vec<u64>,
    /// Bytes of evidence and number of frames, by view.
    evidence: Vec<[u64; 2]>,
    calibration: Calibration,
    heights: Heights,
    trusted: Trusted,
    people: Counted,
}

impl Tally {
    pub(crate) fn new(scene: &Scene) -> Self {
        let names = || scene.views.iter().map(|view| view.name.clone());
        Self {
            summary: Summary {
                views_present: names().map(|name| (name, 0)).collect(),
                views_missing: names().map(|name| (name, BTreeMap::new())).collect(),
                searches: names().map(|name| (name, BTreeMap::new())).collect(),
                evidence_bytes_per_frame: names().map(|name| (name, 0)).collect(),
                views_used: names().map(|name| (name, 0)).collect(),
                ..Summary::default()
            },
            squared_px: (0.0, 0),
            last_frame: None,
            n_without: 0,
            dropped: vec![0; scene.views.len()],
            evidence: vec![[0; 2]; scene.views.len()],
            calibration: Calibration::new(scene),
            heights: Heights::new(scene.views.len()),
            trusted: Trusted::default(),
            people: Counted::new(scene.follow),
        }
    }

    /// Restores the counts of a killed process by reading `pose3d.jsonl` again. A missing file and broken lines are ignored.
    pub(crate) fn resume(scene: &Scene, file: &Path) -> Self {
        let mut tally = Self::new(scene);
        // Line by line, because the file of a long run is large.
        let lines = File::open(file).into_iter().flat_map(|file| BufReader::new(file).split(b'\n'));
        for text in lines.map_while(Result::ok) {
            for line in runfiles::lines(&String::from_utf8_lossy(&text)).flatten() {
                tally.line(scene, &line);
            }
        }
        tally
    }

    fn line(&mut self, scene: &Scene, line: &FrameLine) {
        if !line.has_result() {
            return self.without(line.frame);
        }
        let used = || line.people.iter().flat_map(|person| &person.views_used);
        let is_used = |name: &str| used().any(|used| used == name);
        let why = |name: &str| line.views_missing.get(name).map(Missing::text);
        self.frame(scene, line.frame, line.has_pose());
        self.views(&is_used, &why);
        for person in &line.people {
            self.people.line(line.frame, person, line.time_s);
        }
        let joints = line.people.iter().flat_map(|person| person.joints.values());
        let placed = joints.filter_map(|joint| joint.placed());
        for px in placed.filter_map(|joint| joint.reprojection_px) {
            self.pixels(px);
        }
    }

    /// Counts a frame.
    pub(crate) fn add(&mut self, scene: &Scene, record: &FrameRecord) {
        let frame = &record.skeletons;
        let people = frame.listed();
        let used = people.iter().fold(0, |all, person| all | person.views_used);
        let used = scene.names(used);
        let missing = missing(scene, record);
        self.frame(scene, record.frame(), frame.status == Status::OK);
        self.views(&|name| used.contains(&name), &|name| {
            missing.get(name).copied()
        });
        for (_, joint) in people.iter().flat_map(|person| joints(scene, person)) {
            if is_placed(joint) && joint.reprojection_px.is_finite() {
                self.pixels(joint.reprojection_px);
            }
        }
        self.searches(scene, record);
        self.calibration.add(scene, record);
        self.heights.add(scene, frame);
        let seen = (
            scene.time_s(record.frame()),
            &own::distances_m(scene, record)[..],
        );
        self.trusted.add(record.followed(), scene.joints.limbs, seen);
        for person in people {
            self.people.person(record.frame(), person, scene.joints.limbs, seen.0);
        }
        if let Some(now_s) = seen.0 {
            self.people.forget(now_s);
        }
        self.people.add(frame);
        for (count, it) in self.dropped.iter_mut().zip(&record.views) {
            *count = it.frame.as_ref().map_or(*count, |frame| frame.n_dropped);
        }
    }

    fn searches(&mut self, scene: &Scene, record: &FrameRecord) {
        let views = scene.views.iter().zip(&record.views).zip(&mut self.evidence);
        for ((view, it), [bytes, n]) in views {
            let searched = it
                .pose
                .filter(|pose| pose.status == Status::OK || pose.status == Status::NO_DETECTION);
            let Some(pose) = searched else { continue };
            *bytes = bytes.saturating_add(pose.evidence_bytes);
            *n += 1;
            let summary = &mut self.summary;
            let of_view = summary.searches.entry(view.name.clone()).or_default();
            *of_view.entry(pose.searched.name().to_owned()).or_default() += 1;
            let ages_s = pose.ages_s.iter().take(pose.n_candidates as usize);
            summary.sightings += ages_s.len() as u64;
            let predicted = ages_s.filter(|age_s| **age_s > 0.0).count();
            summary.sightings_predicted += predicted as u64;
            let mean = *bytes / *n;
            summary.evidence_bytes_per_frame.insert(view.name.clone(), mean);
        }
    }

    fn frame(&mut self, scene: &Scene, frame: u64, has_pose: bool) {
        let step = scene.frame_step.max(1);
        let skipped = self.last_frame.replace(frame).map_or(0, |last| {
            (frame.saturating_sub(last) / step).saturating_sub(1)
        });
        self.summary.frames += 1;
        self.summary.frames_missed = self.summary.frames_missed.saturating_add(skipped);
        self.summary.frames_with_pose += u64::from(has_pose);
    }

    fn views<'a>(&mut self, is_used: &dyn Fn(&str) -> bool, why: &dyn Fn(&str) -> Option<&'a str>) {
        let summary = &mut self.summary;
        let mut n_missing = 0;
        for (name, count) in &mut summary.views_present {
            let Some(reason) = why(name) else {
                *count += 1;
                continue;
            };
            n_missing += 1;
            let reasons = summary.views_missing.entry(name.clone()).or_default();
            *reasons.entry(reason.into()).or_default() += 1;
        }
        summary.frames_with_views_missing += u64::from(n_missing > 0);
        for (name, count) in &mut summary.views_used {
            *count += u64::from(is_used(name));
        }
    }

    fn pixels(&mut self, px: f64) {
        self.squared_px.0 += px.powi(2);
        self.squared_px.1 += 1;
    }

    /// Counts results that were received but could not be written in time.
    pub(crate) fn missed(&mut self, n: u64) {
        self.summary.frames_not_recorded += n;
    }

    /// Counts a failed write. Returns true if it is the first.
    pub(crate) fn failed(&mut self, what: &dyn core::fmt::Display) -> bool {
        self.summary.writes_failed += 1;
        let is_first = self.summary.first_failure.is_none();
        self.summary.first_failure.get_or_insert_with(|| what.to_string());
        is_first
    }

    /// Counts a frame without a result.
    pub(crate) fn without(&mut self, frame: u64) {
        self.last_frame = Some(frame);
        self.summary.frames_missed += 1;
        self.n_without += 1;
    }

    /// Returns the last counted frame.
    pub(crate) fn last_frame(&self) -> Option<u64> {
        self.last_frame
    }

    /// Returns the number of counted frames, with and without a result.
    pub(crate) fn n_lines(&self) -> u64 {
        self.summary.frames + self.n_without
    }

    /// Returns the summary so far.
    pub(crate) fn summary(&self) -> Summary {
        let (sum, n) = self.squared_px;
        let names = self.summary.views_used.iter().map(|views_used| &views_used.0);
        Summary {
            reprojection_px: (n > 0).then(|| (sum / n as f64).sqrt()),
            frames_dropped_by_capture: self.dropped.iter().sum(),
            calibration: self.calibration.fits(names.clone().cloned()),
            exchanged: self.calibration.exchanged().cloned(),
            person_px: self.heights.medians(names.clone().cloned()),
            contradicted: self.calibration.contradicted(names.cloned()),
            trust: self.trusted.trust(),
            people: self.people.people(),
            ..self.summary.clone()
        }
    }
}
