//! A synthetic person, identified by a number: sizes, skin, hair, clothes and style of movement.

use crate::body::Proportions;
use crate::colour::{Linear, srgb};
use crate::fabric::{Fabric, Pattern};
use crate::random::Random;

/// A synthetic person. The same number always gives the same person.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Subject {
    pub(crate) number: u64,
    pub(crate) proportions: Proportions,
    /// Thickness of trunk and limbs, relative to the mean.
    pub(crate) girth: f32,
    /// Additional depth of the belly.
    pub(crate) belly: f32,
    /// Shape of the body, from 0 for a man to 1 for a woman.
    pub(crate) curves: f32,
    pub(crate) skin: Linear,
    pub(crate) hair: Hair,
    pub(crate) top: Top,
    pub(crate) bottom: Bottom,
    pub(crate) shoes: Linear,
    pub(crate) style: Style,
}

/// Hair of the head and the face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hair {
    pub(crate) colour: Linear,
    /// Thickness over the skull, in metres; 0 is bald.
    pub(crate) thickness: f32,
    /// Length of the hair below the ears, in metres.
    pub(crate) length: f32,
    pub(crate) beard: bool,
}

/// Clothing of the trunk.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Top {
    pub(crate) fabric: Fabric,
    /// Fraction of the arm that is covered, from the shoulder.
    pub(crate) sleeve: f32,
    /// Length below the hip joints, in metres; negative if the hem is above them.
    pub(crate) hem: f32,
    /// Distance between skin and cloth, in metres.
    pub(crate) slack: f32,
}

/// Clothing of the legs.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bottom {
    pub(crate) fabric: Fabric,
    /// Fraction of the leg that is covered, from the hip.
    pub(crate) leg: f32,
    pub(crate) slack: f32,
    pub(crate) is_skirt: bool,
}

/// Style of movement: factors and angles that are applied to every action.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Style {
    pub(crate) tempo: f64,
    pub(crate) energy: f64,
    pub(crate) arm_swing: f64,
    /// Constant bend of the elbows, the trunk and the shoulders, in degrees.
    pub(crate) elbows: f64,
    pub(crate) stoop: f64,
    pub(crate) arms_out: f64,
    pub(crate) toes_out: f64,
}

const SKINS: &[[u8; 3]] = &[
    [236, 200, 178],
    [224, 180, 152],
    [208, 160, 128],
    [186, 136, 104],
    [150, 104, 78],
    [112, 76, 56],
    [84, 56, 44],
];
const HAIRS: &[[u8; 3]] = &[
    [24, 20, 18],
    [48, 32, 24],
    [84, 56, 36],
    [130, 92, 54],
    [176, 140, 88],
    [150, 146, 140],
    [96, 40, 22],
];
const SHOES: &[[u8; 3]] = &[
    [28, 26, 26],
    [74, 50, 36],
    [226, 224, 218],
    [110, 112, 118],
    [150, 34, 34],
    [40, 54, 96],
];

impl Subject {
    pub(crate) fn new(number: u64) -> Self {
        let random = Random::new(number).fork("subject");
        let mut shape = random.fork("shape");
        let woman = shape.chance(0.45);
        let sign = if woman { 1.0 } else { 0.0 };
        let proportions = Proportions {
            height: 1.765 - 0.125 * sign + 0.06 * shape.normal().clamp(-2.2, 2.2),
            legs: 1.0 + 0.015 * shape.normal(),
            arms: 1.0 + 0.02 * shape.normal(),
            shoulders: 1.0 - 0.09 * sign + 0.03 * shape.normal(),
            hips: 1.0 + 0.06 * sign + 0.03 * shape.normal(),
        };
        let girth = (1.0 - 0.06 * sign + 0.07 * shape.normal()).clamp(0.82, 1.2);
        let mut looks = random.fork("looks");
        let skin = srgb(*looks.pick(SKINS)) * looks.range(0.9, 1.08) as f32;
        Self {
            number,
            proportions,
            girth: girth as f32,
            belly: (girth * shape.range(0.94, 1.14)) as f32,
            curves: sign as f32,
            skin,
            hair: hair(&mut looks, woman),
            top: top(&mut random.fork("top")),
            bottom: bottom(&mut random.fork("bottom"), woman),
            shoes: srgb(*looks.pick(SHOES)),
            style: style(&mut random.fork("manner")),
        }
    }
}

fn hair(random: &mut Random, woman: bool) -> Hair {
    let bald = !woman && random.chance(0.1);
    let long = random.chance(if woman { 0.7 } else { 0.08 });
    Hair {
        colour: srgb(*random.pick(HAIRS)),
        thickness: if bald {
            0.0
        } else {
            random.range(0.006, 0.02) as f32
        },
        length: if long && !bald {
            random.range(0.04, 0.16) as f32
        } else {
            0.0
        },
        beard: !woman && random.chance(0.25),
    }
}

fn top(random: &mut Random) -> Top {
    let sleeve = match random.unit() {
        it if it < 0.5 => random.range(0.22, 0.4),
        it if it < 0.58 => 0.02,
        _ => random.range(0.92, 0.98),
    };
    Top {
        fabric: Fabric::any(random, Fabric::TOPS, Pattern::ON_TOPS),
        sleeve: sleeve as f32,
        hem: random.range(-0.06, 0.10) as f32,
        slack: random.range(0.008, 0.02) as f32,
    }
}

fn bottom(random: &mut Random, woman: bool) -> Bottom {
    let is_skirt = woman && random.chance(0.25);
    let is_short = random.chance(0.3);
    let leg = match (is_skirt, is_short) {
        (true, _) => random.range(0.4, 0.62),
        (_, true) => random.range(0.32, 0.5),
        _ => random.range(0.93, 0.99),
    };
    Bottom {
        fabric: Fabric::any(random, Fabric::BOTTOMS, Pattern::ON_BOTTOMS),
        leg: leg as f32,
        slack: random.range(0.006, 0.02) as f32,
        is_skirt,
    }
}

fn style(random: &mut Random) -> Style {
    Style {
        tempo: random.range(0.88, 1.12),
        energy: random.range(0.85, 1.15),
        arm_swing: random.range(0.6, 1.3),
        elbows: random.range(4.0, 22.0),
        stoop: random.range(-2.0, 7.0),
        arms_out: random.range(7.0, 14.0),
        toes_out: random.range(2.0, 12.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_subject_number_determines_the_person() {
        assert_eq!(Subject::new(3), Subject::new(3));
        for number in 0..50 {
            assert_ne!(Subject::new(number), Subject::new(number + 1));
        }
    }

    #[test]
    fn people_vary_in_every_property() {
        let people: Vec<Subject> = (0..200).map(Subject::new).collect();
        let has = |property: &dyn Fn(&Subject) -> bool| {
            let n = people.iter().filter(|person| property(person)).count();
            (4..196).contains(&n)
        };
        assert!(has(&|person| person.curves > 0.5));
        assert!(has(&|person| person.bottom.is_skirt));
        assert!(has(&|person| person.top.sleeve > 0.5));
        assert!(has(&|person| person.bottom.leg > 0.7));
        assert!(has(&|person| person.hair.length > 0.0));
        assert!(has(&|person| person.hair.beard));
        for it in &people {
            assert!((1.4..2.1).contains(&it.proportions.height));
        }
    }
}
