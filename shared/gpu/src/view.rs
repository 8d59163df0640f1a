//! The search of one view on a GPU.

use std::sync::{Arc, Mutex, PoisonError};

use fmp::{Bounds, Layout, Model, Placement, Pose, Root, Solver};
use kernels::Rgb8View;
use wgpu::{Buffer, CommandEncoder};

use crate::device::{Device, Piece};
use crate::dispatch::Dispatch;
use crate::group::{self, BATCH, Group, Parts, Shared};
use crate::picture::Features;
use crate::programs::{Programs, Sizes};
use crate::tree::Tree;
use crate::{DeviceLost, Found, Unsuitable, Wanted, suits};

/// Searches the frames of one view on a GPU. All frames have the same size.
///
/// One frame is searched at a time; other callers wait.
#[derive(Debug)]
pub struct View {
    device: Arc<Device>,
    model: Arc<Model>,
    layout: Arc<Layout>,
    solver: Solver,
    tree: Tree,
    features: Features,
    groups: Vec<Group>,
    /// Memory that the CPU and the device can access.
    staging: Mutex<Option<Buffer>>,
}

/// A possible root of a pose, and its location on the device.
#[derive(Debug, Clone, Copy)]
struct Peak {
    root: Root,
    group: usize,
    /// Index of the cell in the group.
    cell: usize,
}

/// The location of a level on the device.
#[derive(Debug, Clone, Copy)]
struct Place {
    level: usize,
    group: usize,
    /// Index of the level's first cell in the group.
    cell0: usize,
}

/// The type of a root that is not a peak.
const NO_PEAK: u32 = 255;

impl View {
    /// Compiles the kernels for a model and a size of images, which takes seconds.
    ///
    /// # Errors
    ///
    /// Fails with [`Unsuitable`]: the device cannot be used, and the CPU has to do the search.
    pub fn new(
        device: &Arc<Device>,
        model: Arc<Model>,
        layout: Arc<Layout>,
    ) -> Result<Self, Unsuitable> {
        suits::layout(&layout)?;
        let slots = suits::device(device, suits::shape(&model)?.n_types)?;
        let tree = Tree::new(&model, &layout, slots)?;
        let programs = Programs::new(
            device,
            Sizes {
                side: tree.side,
                parts: tree.n_parts,
                types: tree.n_types,
                reach: tree.reach,
                slots,
            },
        )?;
        let ranges = group::split(device, &layout)?;
        let features = Features::new(device, &programs, &model, &layout)?;
        let shared = Shared::new(device, &tree);
        let parts = Parts {
            device,
            programs: &programs,
            tree: &tree,
            shared: &shared,
            layout: &layout,
            features: &features.values,
        };
        let groups = ranges.into_iter().map(|range| Group::new(&parts, range));
        let groups = groups.collect();
        match device.complaint() {
            Some(why) => Err(Unsuitable::Refused { why }),
            None => Ok(Self {
                device: Arc::clone(device),
                solver: Solver::new(Arc::clone(&model)),
                model,
                layout,
                tree,
                features,
                groups,
                staging: Mutex::default(),
            }),
        }
    }

    /// Searches an image.
    ///
    /// * `levels`: called with the candidates; returns the levels whose evidence is needed for them.
    /// * `evidence`: [`Layout::n_responses`] values. Only the values of the returned levels are written.
    ///
    /// # Errors
    ///
    /// Fails with [`DeviceLost`]; `evidence` may then be partly written.
    ///
    /// # Panics
    ///
    /// Panics if the size of the image or of `evidence` does not match the layout.
    pub fn search(
        &self,
        image: Rgb8View<'_>,
        wanted: Wanted,
        levels: &dyn Fn(&[Pose]) -> Vec<u16>,
        evidence: &mut [f32],
    ) -> Result<Found, DeviceLost> {
        let mut staging = self.staging.lock().unwrap_or_else(PoisonError::into_inner);
        self.upload(image)?;
        let responses = self.groups.iter().map(|group| &group.responses);
        let all = self.features.dispatches.iter().chain(responses);
        let found = self.solved(all, wanted, &mut staging)?;
        let levels = levels(&found.candidates);
        self.read_maps(&levels, evidence, &mut staging)?;
        Ok(found)
    }

    /// Finds the poses from given responses, for comparisons with the CPU.
    ///
    /// * `responses`: [`Layout::n_responses`] values.
    ///
    /// # Errors
    ///
    /// Fails with [`DeviceLost`].
    pub fn solve(&self, responses: &[f32], wanted: Wanted) -> Result<Found, DeviceLost> {
        let mut staging = self.staging.lock().unwrap_or_else(PoisonError::into_inner);
        for group in &self.groups {
            self.device.check()?;
            let first = self.layout.levels[group.levels.start].offset;
            let n = group.memory.maps.size() as usize / size_of::<f32>();
            let bytes = bytemuck::cast_slice(&responses[first..first + n]);
            self.device.queue().write_buffer(&group.memory.maps, 0, bytes);
        }
        self.solved(std::iter::empty(), wanted, &mut staging)
    }

    /// Returns the features of all levels, `[level][row][col][channel]`, for comparisons with the CPU.
    ///
    /// # Errors
    ///
    /// Fails with [`DeviceLost`].
    ///
    /// # Panics
    ///
    /// Panics if the size of the image does not match the layout.
    pub fn features(&self, image: Rgb8View<'_>) -> Result<Vec<f32>, DeviceLost> {
        let mut staging = self.staging.lock().unwrap_or_else(PoisonError::into_inner);
        self.upload(image)?;
        let mut encoder = self.encoder()?;
        record(&mut encoder, &mut self.features.dispatches.iter());
        let mut values = Vec::new();
        let all = Piece::whole(&self.features.values);
        self.device.read(encoder, &[all], &mut staging, &mut |bytes| {
            values.extend_from_slice(bytemuck::cast_slice(bytes));
        })?;
        Ok(values)
    }

    fn encoder(&self) -> Result<CommandEncoder, DeviceLost> {
        self.device.check()?;
        Ok(self
            .device
            .raw()
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default()))
    }

    fn upload(&self, image: Rgb8View<'_>) -> Result<(), DeviceLost> {
        let size = [image.width(), image.height()];
        assert_eq!(size, self.layout.image_size, "layout of this image");
        self.device.check()?;
        let (whole, rest) = image.data().as_chunks::<4>();
        let queue = self.device.queue();
        queue.write_buffer(&self.features.image, 0, whole.as_flattened());
        if !rest.is_empty() {
            let mut last = [0; 4];
            last[..rest.len()].copy_from_slice(rest);
            queue.write_buffer(&self.features.image, 4 * whole.len() as u64, &last);
        }
        Ok(())
    }

    /// Runs the given kernels, then the messages, and finds the poses.
    fn solved<'a>(
        &'a self,
        before: impl Iterator<Item = &'a Dispatch>,
        wanted: Wanted,
        staging: &mut Option<Buffer>,
    ) -> Result<Found, DeviceLost> {
        let mut encoder = self.encoder()?;
        for group in &self.groups {
            encoder.clear_buffer(&group.memory.ranges, 0, None);
        }
        let messages = self.groups.iter().flat_map(|group| &group.messages);
        record(&mut encoder, &mut before.chain(messages));
        let pieces: Vec<Piece<'_>> = self
            .groups
            .iter()
            .flat_map(|group| [&group.memory.peaks, &group.memory.ranges].map(Piece::whole))
            .collect();
        let (mut peaks, mut bounds) = (Vec::new(), Vec::new());
        self.device.read(encoder, &pieces, staging, &mut |bytes| {
            let mut words: &[u32] = bytemuck::cast_slice(bytes);
            for (group_idx, group) in self.groups.iter().enumerate() {
                let (of_cells, rest) = words.split_at(group.memory.peaks.size() as usize / 4);
                let (ranges, rest) = rest.split_at(group.memory.ranges.size() as usize / 4);
                words = rest;
                for (within, level) in group.levels.clone().enumerate() {
                    let cells = group.cells[within]..group.cells[within + 1];
                    let of_cells = &of_cells[2 * cells.start..2 * cells.end];
                    let place = Place {
                        level,
                        group: group_idx,
                        cell0: cells.start,
                    };
                    peaks.extend(self.peaks(place, of_cells));
                    let n = ranges.len() / group.levels.len();
                    let (best, largest) = group::extremes(&ranges[within * n..][..n], &self.tree);
                    bounds.push(self.solver.bound_of(best, &largest));
                }
            }
        })?;
        Ok(Found {
            candidates: self.distinct(&mut peaks, wanted, staging)?,
            bounds: Bounds::new(bounds),
        })
    }

    /// The peaks of a level.
    fn peaks(&self, place: Place, of_cells: &[u32]) -> impl Iterator<Item = Peak> {
        let cols = self.layout.levels[place.level].cols;
        let cells = of_cells.as_chunks().0.iter().enumerate();
        let peaks = cells.filter(|(_, [_, mixture])| *mixture != NO_PEAK);
        peaks.map(move |(cell, [score, mixture])| Peak {
            root: Root {
                score: f32::from_bits(*score),
                level: place.level as u16,
                y: cell / cols,
                x: cell % cols,
                mixture: *mixture as usize,
            },
            group: place.group,
            cell: place.cell0 + cell,
        })
    }

    /// The poses of the best peaks that are far enough from each other; see [`Solver::distinct`].
    fn distinct(
        &self,
        mut peaks: &mut [Peak],
        wanted: Wanted,
        staging: &mut Option<Buffer>,
    ) -> Result<Vec<Pose>, DeviceLost> {
        let mut kept: Vec<Pose> = Vec::new();
        let best_first = |a: &Peak, b: &Peak| a.root.best_first(&b.root);
        while kept.len() < wanted.n && !peaks.is_empty() {
            // There are thousands of peaks, but the first few are nearly always enough.
            if peaks.len() > BATCH {
                peaks.select_nth_unstable_by(BATCH, best_first);
            }
            let (next, rest) = peaks.split_at_mut(BATCH.min(peaks.len()));
            next.sort_unstable_by(best_first);
            for pose in self.trace(next, staging)? {
                let of = (&*self.model, &*self.layout);
                if kept.len() < wanted.n && pose.is_apart(&kept, of, wanted.min_separation) {
                    kept.push(pose);
                }
            }
            peaks = rest;
        }
        Ok(kept)
    }

    /// Follows the trees of at most [`BATCH`] roots.
    fn trace(&self, peaks: &[Peak], staging: &mut Option<Buffer>) -> Result<Vec<Pose>, DeviceLost> {
        let mut encoder = self.encoder()?;
        let mut pieces = Vec::new();
        let mut places = Vec::new();
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        for (group_idx, group) in self.groups.iter().enumerate() {
            let own = peaks.iter().enumerate().filter(|(_, peak)| peak.group == group_idx);
            let (own, roots): (Vec<usize>, Vec<u32>) =
                own.map(|(at, peak)| (at, (peak.cell * 8 + peak.root.mixture) as u32)).unzip();
            if own.is_empty() {
                continue;
            }
            self.device
                .queue()
                .write_buffer(&group.memory.wanted, 0, bytemuck::cast_slice(&roots));
            group.trace.record_some(&mut pass, own.len() as u32);
            pieces.push(Piece {
                buffer: &group.memory.poses,
                at: 0,
                n: (own.len() * self.tree.n_parts * 3 * 4) as u64,
            });
            places.extend(own);
        }
        drop(pass);
        let mut poses = vec![Pose::default(); peaks.len()];
        self.device.read(encoder, &pieces, staging, &mut |bytes| {
            let words: &[u32] = bytemuck::cast_slice(bytes);
            for (at, words) in places.iter().zip(words.chunks_exact(3 * self.tree.n_parts)) {
                let place = |words: &[u32; 3]| Placement {
                    x: words[0] as u16,
                    y: words[1] as u16,
                    mixture: words[2] as u8,
                };
                poses[*at] = Pose {
                    score: peaks[*at].root.score,
                    level: peaks[*at].root.level,
                    parts: words.as_chunks().0.iter().map(place).collect(),
                };
            }
        })?;
        Ok(poses)
    }

    /// Reads the responses of some levels.
    fn read_maps(
        &self,
        levels: &[u16],
        evidence: &mut [f32],
        staging: &mut Option<Buffer>,
    ) -> Result<(), DeviceLost> {
        assert!(
            evidence.len() >= self.layout.n_responses(),
            "one value per response"
        );
        let group = |level: usize| self.groups.iter().find(|group| group.levels.contains(&level));
        let levels = levels.iter().map(|level| usize::from(*level));
        let (levels, pieces): (Vec<usize>, Vec<Piece<'_>>) =
            levels.filter_map(|level| Some((level, group(level)?.maps_of(level)))).unzip();
        if levels.is_empty() {
            return Ok(());
        }
        self.device.read(self.encoder()?, &pieces, staging, &mut |bytes| {
            let mut values: &[f32] = bytemuck::cast_slice(bytes);
            for (level, piece) in levels.iter().zip(&pieces) {
                let (maps, rest) = values.split_at(piece.n as usize / size_of::<f32>());
                values = rest;
                evidence[self.layout.levels[*level].offset..][..maps.len()].copy_from_slice(maps);
            }
        })
    }
}

/// Records kernels, one after the other.
fn record(encoder: &mut CommandEncoder, all: &mut dyn Iterator<Item = &Dispatch>) {
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
    for dispatch in all {
        dispatch.record(&mut pass);
    }
}
