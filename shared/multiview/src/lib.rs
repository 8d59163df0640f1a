//! One energy over several views, maximised by alternating exact single-view solutions.
#![forbid(unsafe_code)]
