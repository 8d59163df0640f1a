//! Stands in for `bindgen`, which only builds for QNX use: see `shared/unused/README.md`.
