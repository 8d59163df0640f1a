//! HTML pages about runs and rigs, and the parts that all pages share: one style, and one method to escape text.
//!
//! Every page is a single HTML file without other resources: no font, no picture, no style from elsewhere. The only
//! script is that of [`run`], which draws the skeleton in space.
//!
//! Markup is a separate type that accepts only constants of the program, numbers and escaped text. Templates were
//! considered but not used. Most of these pages is SVG made in loops of numbers with a fixed number of digits, which templates do not
//! shorten. The page of a model is also XML, whose empty elements end with a slash, and `maud` writes only those of HTML.
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
