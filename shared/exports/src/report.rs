//! HTML pages about runs and rigs, and the parts that all pages share: one style, and one method of escaping text.
//!
//! Every page is a single HTML file without other resources: no font, no picture, no style from elsewhere. The only script is the script of
//! [`run`], which draws the skeleton in space.
//!
//! Markup is a separate type that accepts only constants of the program, numbers and escaped text. Templates were considered but are not
//! used, because most of the content of these pages is SVG made in loops from numbers, which templates would not shorten. Also, the page of
//! a model must be valid XML, in which empty elements end with a slash, but the template library `maud` writes empty elements as in HTML.
//! Each page has a test with text that would break the page if it were not escaped.

pub mod html;
pub mod parts;

pub mod boards;
pub mod clocks;
pub mod curves;
pub mod run;
pub mod walk;

pub use crate::{html, put};
pub use html::{STAGE, STYLE};
