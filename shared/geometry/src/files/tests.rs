//! Every format writes what it reads, and refuses what it cannot read.
