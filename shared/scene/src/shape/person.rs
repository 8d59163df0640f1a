//! The solids of a person: body, hair and the slack of the clothes.
//!
//! Sizes in metres apply to a man of 1.75 m and are chosen by eye. All sizes are scaled with the height, and thicknesses
//! also with the girth.

use super::solid::Solid;
use crate::body::{
    ABDOMEN, Bones, CHEST, COLLAR, FOOT, FOREARM, HAND, HEAD, NECK, PELVIS, SHIN, THIGH, UPPER_ARM,
};
use crate::subject::Subject;

struct SolidBuilder<'a> {
    subject: &'a Subject,
    /// Height, relative to a man of 1.75 m.
    scale: f32,
    pieces: Vec<(usize, Solid)>,
}

/// Returns all solids, in the frames of their bones.
pub(super) fn pieces(subject: &Subject, bones: &Bones) -> Vec<(usize, Solid)> {
    let mut builder = SolidBuilder {
        subject,
        scale: subject.proportions.height as f32 / 1.75,
        pieces: Vec::new(),
    };
    builder.trunk();
    builder.head();
    for (side, out) in [(0, 1.0), (1, -1.0)] {
        builder.arm(side, out, bones);
        builder.leg(side, bones);
    }
    if subject.bottom.is_skirt {
        builder.skirt(bones);
    }
    builder.pieces
}

impl SolidBuilder<'_> {
    /// Adds an ellipsoid; centre and radii are in metres for the mean person.
    fn ellipsoid(&mut self, bone: usize, centre: [f32; 3], radii: [f32; 3], slack: f32) {
        let s = self.scale;
        let solid = Solid::ellipsoid(
            centre.map(|centre| s * centre),
            radii.map(|radius| s * radius),
        );
        self.pieces.push((bone, solid.thicker(slack)));
    }

    /// Adds a cone between points in metres; the radii apply to the mean person.
    fn cone(&mut self, bone: usize, ends: [[f32; 3]; 2], radii: [f32; 2], slack: f32) {
        let r = radii.map(|radius| radius * self.scale);
        let solid = Solid::cone(ends[0], ends[1], r).thicker(slack);
        self.pieces.push((bone, solid));
    }

    fn trunk(&mut self) {
        let Subject {
            girth: g,
            belly,
            curves,
            ref top,
            ref bottom,
            ..
        } = *self.subject;
        let wide = |mean: f32, woman: f32| g * (mean + curves * woman);
        let slack = top.slack;
        let hips = bottom.slack.max(if top.hem > 0.0 { slack } else { 0.0 });
        let width = wide(0.155, 0.015) * self.subject.proportions.hips as f32;
        self.ellipsoid(PELVIS, [-0.004, 0.0, 0.04], [g * 0.108, width, 0.105], hips);
        for out in [1.0, -1.0] {
            let r = wide(0.078, 0.008);
            self.ellipsoid(PELVIS, [-0.052, out * 0.07, -0.012], [r, r, 0.085], hips);
        }
        let waist = [belly * 0.106, wide(0.137, -0.014), 0.135];
        self.ellipsoid(ABDOMEN, [0.01, 0.0, 0.05], waist, slack);
        let shoulders = self.subject.proportions.shoulders as f32;
        let chest = [g * 0.112, wide(0.152, 0.0) * shoulders, 0.175];
        self.ellipsoid(CHEST, [0.0, 0.0, 0.075], chest, slack);
        self.ellipsoid(
            CHEST,
            [-0.016, 0.0, 0.15],
            [0.085, 0.155 * shoulders, 0.075],
            slack,
        );
        let bust = 0.052 + 0.018 * curves;
        for out in [1.0, -1.0] {
            let r = [bust, 0.07, 0.062 + 0.006 * curves];
            self.ellipsoid(
                CHEST,
                [0.058 + 0.018 * curves, out * 0.072, 0.085],
                r,
                slack,
            );
            let s = self.scale;
            let to = [-0.016 * s, out * 0.12 * s * shoulders, 0.212 * s];
            let ends = [[-0.018 * s, out * 0.03 * s, 0.245 * s], to];
            self.cone(CHEST, ends, [0.044, 0.042], 0.5 * slack);
        }
        let neck = g.sqrt() * (0.056 - 0.009 * curves);
        let s = self.scale;
        let ends = [[-0.008 * s, 0.0, -0.03 * s], [0.012 * s, 0.0, 0.13 * s]];
        self.cone(NECK, ends, [neck * 1.08, neck], 0.0);
    }

    fn head(&mut self) {
        let hair = self.subject.hair;
        self.ellipsoid(HEAD, [0.008, 0.0, 0.078], [0.095, 0.074, 0.09], 0.0);
        self.ellipsoid(HEAD, [0.040, 0.0, 0.008], [0.062, 0.058, 0.078], 0.0);
        self.ellipsoid(HEAD, [0.074, 0.0, -0.042], [0.026, 0.03, 0.024], 0.0);
        self.ellipsoid(HEAD, [0.106, 0.0, 0.018], [0.018, 0.014, 0.026], 0.0);
        for out in [1.0, -1.0] {
            self.ellipsoid(HEAD, [0.0, out * 0.075, 0.03], [0.024, 0.012, 0.032], 0.0);
        }
        if hair.thickness > 0.0 {
            let r = [0.092, 0.075, 0.086];
            self.ellipsoid(HEAD, [-0.008, 0.0, 0.086], r, hair.thickness);
        }
        if hair.length > 0.0 {
            let s = self.scale;
            let ends = [[-0.05 * s, 0.0, 0.05 * s], [-0.06 * s, 0.0, -hair.length]];
            self.cone(HEAD, ends, [0.075, 0.06], 0.0);
        }
    }

    /// Returns the slack of a sleeve or trouser leg at a position along the limb, given as a fraction of its length.
    fn cover(share: f32, until: f32, slack: f32) -> f32 {
        if share < until { slack } else { 0.0 }
    }

    fn arm(&mut self, side: usize, out: f32, bones: &Bones) {
        let Subject {
            girth: g,
            curves,
            ref top,
            ..
        } = *self.subject;
        let strong = g * (1.0 - 0.12 * curves);
        let upper = -bones.offset[FOREARM[side]].z as f32;
        let lower = -bones.offset[HAND[side]].z as f32;
        let slack = |share: f32| Self::cover(share, top.sleeve, top.slack);
        let shoulder = bones.offset[UPPER_ARM[side]].cast::<f32>();
        self.cone(
            COLLAR[side],
            [[0.0; 3], [shoulder.x, shoulder.y * 0.9, shoulder.z - 0.015]],
            [0.05 * strong, 0.054 * strong],
            slack(0.0),
        );
        let at = |down: f32| [0.0, 0.0, -down];
        let bone = UPPER_ARM[side];
        self.cone(
            bone,
            [at(0.005), at(0.5 * upper)],
            [0.056, 0.046].map(|value| value * strong),
            slack(0.1),
        );
        self.cone(
            bone,
            [at(0.5 * upper), at(upper)],
            [0.046, 0.039].map(|value| value * strong),
            slack(0.4),
        );
        self.ellipsoid(
            bone,
            [0.01, 0.0, -0.15],
            [0.046 * strong, 0.042 * strong, 0.085],
            slack(0.25),
        );
        let bone = FOREARM[side];
        let belly = 0.3 * lower;
        self.cone(
            bone,
            [at(0.0), at(belly)],
            [0.038, 0.042].map(|value| value * strong),
            slack(0.6),
        );
        self.cone(
            bone,
            [at(belly), at(lower)],
            [0.042, 0.027].map(|value| value * strong),
            slack(0.85),
        );
        self.hand(side, out);
    }

    fn hand(&mut self, side: usize, out: f32) {
        let bone = HAND[side];
        self.ellipsoid(bone, [0.0, 0.0, -0.05], [0.04, 0.019, 0.056], 0.0);
        self.ellipsoid(
            bone,
            [0.002, -out * 0.004, -0.125],
            [0.034, 0.015, 0.056],
            0.0,
        );
        let s = self.scale;
        let thumb = [
            [0.024 * s, -out * 0.004 * s, -0.03 * s],
            [0.05 * s, -out * 0.012 * s, -0.088 * s],
        ];
        self.cone(bone, thumb, [0.015, 0.011], 0.0);
    }

    fn leg(&mut self, side: usize, bones: &Bones) {
        let Subject {
            girth: g,
            curves,
            ref bottom,
            ..
        } = *self.subject;
        let upper = -bones.offset[SHIN[side]].z as f32;
        let lower = -bones.offset[FOOT[side]].z as f32;
        let until = if bottom.is_skirt { 0.0 } else { bottom.leg };
        let slack = |share: f32, of: f32| Self::cover(share, until, of * bottom.slack);
        let at = |back: f32, down: f32| [-back, 0.0, -down];
        let thick = |radii: [f32; 2]| radii.map(|radius| radius * g * (1.0 + 0.03 * curves));
        let bone = THIGH[side];
        self.cone(
            bone,
            [at(0.0, 0.015), at(0.0, 0.5 * upper)],
            thick([0.088, 0.074]),
            slack(0.1, 0.7),
        );
        self.cone(
            bone,
            [at(0.0, 0.5 * upper), at(0.0, upper)],
            thick([0.074, 0.054]),
            slack(0.36, 1.0),
        );
        let bone = SHIN[side];
        let calf = 0.32 * lower;
        self.cone(
            bone,
            [at(0.0, 0.0), at(0.008, calf)],
            thick([0.053, 0.05]),
            slack(0.6, 1.0),
        );
        self.ellipsoid(
            bone,
            [-0.024, 0.0, -0.14],
            [0.04 * g, 0.048 * g, 0.1],
            slack(0.7, 1.0),
        );
        self.cone(
            bone,
            [at(0.008, calf), at(0.0, lower)],
            thick([0.05, 0.036]),
            slack(0.85, 1.3),
        );
        let bone = FOOT[side];
        let s = self.scale;
        let ends = [[-0.03 * s, 0.0, -0.034 * s], [0.11 * s, 0.0, -0.04 * s]];
        self.cone(bone, ends, [0.034, 0.028], 0.004);
        self.ellipsoid(bone, [0.125, 0.0, -0.045], [0.062, 0.044, 0.023], 0.004);
    }

    fn skirt(&mut self, bones: &Bones) {
        let leg = -(bones.offset[SHIN[0]].z + bones.offset[FOOT[0]].z) as f32;
        let down = self.subject.bottom.leg * leg;
        let g = self.subject.girth;
        let ends = [[0.0, 0.0, 0.05], [0.0, 0.0, -0.75 * down]];
        self.cone(
            PELVIS,
            ends,
            [0.135 * g, 0.175 * g],
            self.subject.bottom.slack,
        );
    }
}
