//! Springs: rest position of a child, and its range of movement.

use fmp::{Edge, Spring, Springs};

use super::SPRING_COST;
use super::colours::type_colour;
use exports::report::html::Html;
use exports::report::{html, put};

/// Rest position of a spring, and the ellipse on which it costs [`SPRING_COST`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ellipse {
    /// Offset of the child from its parent, in cells.
    pub(super) centre: [f64; 2],
    /// Half axes, in cells.
    pub(super) radius: [f64; 2],
}

impl Ellipse {
    /// Computes the ellipse. On each axis, the spring costs `w0 d^2 + w1 d` with `d = anchor - offset`, which is smallest at `d = -w1 / (2
    /// w0)`.
    pub(super) fn of(spring: &Spring) -> Self {
        let axis = |value: usize| [spring.w[2 * value], spring.w[2 * value + 1]];
        let [x, y] = spring.anchor.map(f64::from);
        let rest = |[square, linear]: [f64; 2]| linear / (2.0 * square);
        Self {
            centre: [x + rest(axis(0)), y + rest(axis(1))],
            radius: [0, 1].map(|i| (SPRING_COST / axis(i)[0]).sqrt()),
        }
    }
}

/// Returns, for each spring, the type of the child and the ellipse.
pub(super) fn ellipses(edge: &Edge) -> Vec<(usize, Ellipse)> {
    match &edge.springs {
        Springs::PerChildType(all) => all.iter().map(Ellipse::of).enumerate().collect(),
        Springs::PerTypePair(rows) => rows
            .iter()
            .flat_map(|row| row.iter().enumerate())
            .filter_map(|(own, it)| it.as_ref().map(|spring| (own, Ellipse::of(spring))))
            .collect(),
    }
}

/// Returns the spring of a pair of types; `None` if the pair never occurs.
pub(super) fn of_pair(edge: &Edge, parent_type: usize, own_type: usize) -> Option<Ellipse> {
    match &edge.springs {
        Springs::PerChildType(all) => all.get(own_type).map(Ellipse::of),
        Springs::PerTypePair(rows) => {
            rows.get(parent_type)?.get(own_type)?.as_ref().map(Ellipse::of)
        }
    }
}

/// Draws all springs of a part around the parent, in cells.
pub(super) fn panel(edge: &Edge) -> Html {
    const SIDE: f64 = 150.0;
    let all = ellipses(edge);
    let reach = all
        .iter()
        .flat_map(|(_, it)| [0, 1].map(|axis| it.centre[axis].abs() + it.radius[axis].min(20.0)));
    let reach = reach.fold(3.0, f64::max).ceil();
    let mut out = html!(
        "<figure><svg class=\"light\" width=\"{SIDE}\" height=\"{SIDE}\" viewBox=\"{0} {0} {1} {1}\">",
        [SIDE],
        -reach,
        2.0 * reach
    );
    let mut ticks = Html::default();
    for tick in -(reach as i32)..=reach as i32 {
        put!(
            ticks,
            "M{tick} {0}V{1}M{0} {tick}H{1}",
            [tick],
            -reach,
            reach
        );
    }
    let hair = reach / SIDE;
    put!(
        out,
        "<path d=\"{ticks}\" stroke=\"#eef0f3\" stroke-width=\"{hair:.3}\"/>\
         <path d=\"M-.5 0H.5M0 -.5V.5\" stroke=\"#1d2430\" stroke-width=\"{:.3}\"/>",
        [ticks, hair],
        3.0 * hair
    );
    for (own, it) in &all {
        let colour = type_colour(*own);
        let [[x, y], [rx, ry]] = [it.centre, it.radius];
        put!(
            out,
            "<g stroke=\"{colour}\" stroke-width=\"{:.3}\" fill=\"{colour}\"><ellipse cx=\"{x:.2}\" cy=\"{y:.2}\" \
             rx=\"{rx:.2}\" ry=\"{ry:.2}\" fill-opacity=\".08\"/><circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{:.2}\"/>\
             <title>type {}: ({x:.2}, {y:.2}) cells, half axes {rx:.2} and {ry:.2}</title></g>",
            [colour, x, y, rx, ry],
            2.0 * hair,
            5.0 * hair,
            own + 1
        );
    }
    put!(
        out,
        "</svg><figcaption>springs, \u{b1}{reach} cells</figcaption></figure>\n",
        [reach]
    );
    out
}
