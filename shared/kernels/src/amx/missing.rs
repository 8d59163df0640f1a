//! Systems without support for AMX.

use super::{Amx, NoAmx};
use crate::tiles::{Block, Sums};

pub(super) const PRODUCTS_OF_ROUND: usize = 0;

pub(super) fn permitted() -> Result<(), NoAmx> {
    Err(NoAmx::System)
}

/// Cannot be created, since there is no [`Amx`].
pub(crate) struct Tiles(std::convert::Infallible);

impl Tiles {
    pub(crate) fn new(_: Amx) -> Self {
        unreachable!("there is no `Amx` on this system")
    }

    pub(super) fn exercise(&self, _: usize) {
        match self.0 {}
    }

    pub(crate) fn sums(&self, _: &Sums<'_>, _: &mut Block) {
        match self.0 {}
    }
}
