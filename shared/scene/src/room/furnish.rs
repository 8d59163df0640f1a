//! Creates random rooms.

use nalgebra::{Point3, Vector3};

use super::{Block, Material, Panel, Room};
use crate::light::Light;
use crate::random::Random;

const FLOORS: [Material; 8] = [
    Material::Wood([168, 124, 80]),
    Material::Wood([120, 84, 56]),
    Material::Wood([196, 164, 124]),
    Material::Tiles([176, 170, 160], 0.45),
    Material::Tiles([150, 156, 158], 0.6),
    Material::Carpet([110, 116, 128]),
    Material::Carpet([132, 104, 86]),
    Material::Plain([146, 144, 140]),
];
const WALLS: [Material; 8] = [
    Material::Plain([206, 200, 188]),
    Material::Plain([188, 196, 200]),
    Material::Plain([176, 186, 164]),
    Material::Plain([204, 188, 160]),
    Material::Plain([140, 148, 160]),
    Material::Paper([196, 186, 172]),
    Material::Bricks([160, 98, 76]),
    Material::Plain([226, 224, 218]),
];
const BODIES: [Material; 7] = [
    Material::Wood([140, 98, 60]),
    Material::Plain([224, 222, 216]),
    Material::Plain([70, 76, 84]),
    Material::Plain([150, 60, 50]),
    Material::Plain([76, 104, 120]),
    Material::Wood([186, 148, 102]),
    Material::Plain([64, 100, 66]),
];

/// Radius around the middle of the room, in metres, within which there is only the furniture that the action needs.
const CLEAR_RADIUS: f32 = 1.75;

pub(super) fn room(random: Random, cameras: &[Point3<f32>], furniture: Vec<Block>) -> Room {
    let mut any = random.fork("room");
    let mut margin = || any.range(0.5, 1.3) as f32;
    let (mut low, mut high) = (Vector3::new(-2.6, -2.6, 0.0), Vector3::new(2.6, 2.6, 2.7));
    for camera in cameras {
        low = low.inf(&camera.coords.add_scalar(-margin()));
        high = high.sup(&camera.coords.add_scalar(margin()));
    }
    low.z = 0.0;
    let mut any = random.fork("finish");
    let mut room = Room {
        low,
        high,
        floor: *any.pick(&FLOORS),
        wall: *any.pick(&WALLS),
        panels: core::array::from_fn(|wall| {
            panels(random.fork("wall").nth(wall as u64), wall, low, high)
        }),
        blocks: furniture,
        light: Light::new(random.fork("light")),
    };
    for nth in 0..22 {
        let pieces = wall_furniture(random.fork("thing").nth(nth), low, high);
        let free = |block: &Block| {
            is_free(block, cameras) && !room.blocks.iter().any(|other| touch(block, other))
        };
        if pieces.iter().all(free) {
            room.blocks.extend(pieces);
        }
    }
    room
}

fn panels(mut random: Random, wall: usize, low: Vector3<f32>, high: Vector3<f32>) -> Vec<Panel> {
    let (from, to) = if wall < 2 {
        (low.y, high.y)
    } else {
        (low.x, high.x)
    };
    let mut panels = Vec::new();
    let mut at = from + random.range(0.3, 1.4) as f32;
    while at < to - 0.8 {
        let seed = random.bits() as u32;
        let (half, up, material) = match random.unit() {
            it if it < 0.3 => ([0.6, 0.65], 1.5, Material::Window(seed)),
            it if it < 0.45 => ([0.45, 1.02], 1.02, Material::Wood([150, 116, 82])),
            _ => {
                let half = [
                    random.range(0.2, 0.45) as f32,
                    random.range(0.25, 0.4) as f32,
                ];
                (half, random.range(1.4, 1.8) as f32, Material::Poster(seed))
            }
        };
        panels.push(Panel {
            middle: [at + half[0], up],
            half,
            material,
        });
        at += 2.0 * half[0] + random.range(0.3, 1.6) as f32;
    }
    panels
}

/// Random furniture at a wall: a cupboard, a shelf, cartons, a plant, a chair.
fn wall_furniture(mut random: Random, low: Vector3<f32>, high: Vector3<f32>) -> Vec<Block> {
    let wall = random.bits() % 4;
    let off = random.range(0.02, 0.5) as f32;
    let along = random.range(0.05, 0.95) as f32;
    let x = low.x + (high.x - low.x) * along;
    let y = low.y + (high.y - low.y) * along;
    let place = |depth: f32| match wall {
        0 => [low.x + off + depth, y],
        1 => [high.x - off - depth, y],
        2 => [x, low.y + off + depth],
        _ => [x, high.y - off - depth],
    };
    let turned = if wall < 2 {
        core::f32::consts::FRAC_PI_2
    } else {
        0.0
    };
    let seed = random.bits() as u32;
    let material = *random.pick(&BODIES);
    let mut size = |low: f64, high: f64| random.range(low, high) as f32;
    match seed % 5 {
        0 | 1 => {
            let half = [size(0.3, 0.7), size(0.18, 0.3), size(0.35, 1.0)];
            let [x, y] = place(half[1]);
            let material = if seed.is_multiple_of(3) {
                Material::Books(seed)
            } else {
                material
            };
            vec![Block::new([x, y, half[2]], half, turned, material)]
        }
        2 => {
            let (mut up, [x, y], mut all) = (0.0, place(0.3), Vec::new());
            for nth in 0..2 + seed / 8 % 2 {
                let half = [size(0.15, 0.28), size(0.15, 0.28), size(0.12, 0.22)];
                let material = if nth == 1 {
                    Material::Plain([182, 146, 100])
                } else {
                    material
                };
                all.push(Block::new(
                    [x, y, up + half[2]],
                    half,
                    size(-0.5, 0.5),
                    material,
                ));
                up += 2.0 * half[2];
            }
            all
        }
        3 => plant(place(0.25)),
        _ => chair(place(0.3), size(0.0, 6.0), material),
    }
}

fn plant([x, y]: [f32; 2]) -> Vec<Block> {
    let block = |r: f32, at: f32, high: f32, yaw: f32, c: [u8; 3]| {
        Block::new([x, y, at], [r, r, high], yaw, Material::Carpet(c))
    };
    vec![
        block(0.16, 0.18, 0.18, 0.2, [150, 84, 60]),
        block(0.2, 0.6, 0.2, 0.6, [56, 96, 48]),
        block(0.26, 0.85, 0.16, 1.1, [66, 112, 54]),
        block(0.15, 1.1, 0.14, 0.3, [52, 90, 44]),
    ]
}

fn chair([x, y]: [f32; 2], yaw: f32, material: Material) -> Vec<Block> {
    let (sin, cos) = yaw.sin_cos();
    let block = |at: [f32; 3], half: [f32; 3]| {
        let centre = [
            x + cos * at[0] - sin * at[1],
            y + sin * at[0] + cos * at[1],
            at[2],
        ];
        Block::new(centre, half, yaw, material)
    };
    vec![
        block([0.0, 0.0, 0.44], [0.21, 0.21, 0.025]),
        block([-0.2, 0.0, 0.74], [0.02, 0.2, 0.2]),
        block([0.17, 0.17, 0.21], [0.018, 0.018, 0.21]),
        block([0.17, -0.17, 0.21], [0.018, 0.018, 0.21]),
        block([-0.19, 0.17, 0.36], [0.018, 0.018, 0.36]),
        block([-0.19, -0.17, 0.36], [0.018, 0.018, 0.36]),
    ]
}

/// Returns true if a block is outside the stage, and neither at nor in front of a camera.
fn is_free(block: &Block, cameras: &[Point3<f32>]) -> bool {
    let [x, y, _] = block.centre;
    let reach = block.half[0].hypot(block.half[1]);
    if x.hypot(y) - reach < CLEAR_RADIUS {
        return false;
    }
    let grown = block.grown(0.15);
    cameras.iter().all(|camera| {
        let from = *camera;
        let apart = (from.x - x).hypot(from.y - y) > reach + 0.35;
        let seen = |turn: usize, up: f32| {
            let (sin, cos) = (turn as f32 * core::f32::consts::FRAC_PI_4).sin_cos();
            let way = Vector3::new(1.2 * cos, 1.2 * sin, up) - from.coords;
            grown.enter(&from, &way).is_none_or(|hit| hit.0 > 1.0)
        };
        apart && (0..8).all(|turn| [0.0, 0.9, 1.9].into_iter().all(|up| seen(turn, up)))
    })
}

/// Returns true if two blocks are so close that they may touch.
fn touch(a: &Block, b: &Block) -> bool {
    let reach = |block: &Block| block.half[0].hypot(block.half[1]);
    (a.centre[0] - b.centre[0]).hypot(a.centre[1] - b.centre[1]) < reach(a) + reach(b)
}
