//! A run as one HTML page: limits that held or did not, the skeleton in space, who was there when, tables, pictures.
//!
//! The page needs nothing but itself, and says so to the browser: its policy forbids every request. The view of the
//! skeleton is a canvas that a short script of ours draws (`page.js`): drag to turn, play, pause, step.
#![forbid(unsafe_code)]

mod page;
mod space;
mod text;
mod timeline;

pub use page::{Limit, Page, Picture, STYLE, Strip, Table, html};
pub use space::{Eye, Moment, Point, Space};
pub use timeline::Mark;
