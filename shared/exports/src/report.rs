//! Pages for people: of a run and of a rig, and what all pages are made with. One look, one way to escape.
//!
//! Every page is one HTML file that needs nothing but itself: no font, no picture, no style from elsewhere, and no
//! script but the one of [`run`] that draws the skeleton in space.
//!
//! Markup is a type of its own, which only constants of the program, numbers and escaped text get into. Templates were
//! considered: most of these pages is SVG made in loops of numbers with a fixed count of digits, which templates do not
//! shorten, and the page of a model is XML, too, whose empty elements end with a slash; `maud` writes those of HTML only.
//! Each page has a test with text that would break it.

pub mod html;
pub mod parts;

pub mod boards;
pub mod clocks;
pub mod curves;
pub mod run;
pub mod walk;

pub use crate::{html, put};
pub use html::{STAGE, STYLE};
