//! The instruction sets of the machine.

/// An instruction set that this machine has.
///
/// Every kernel gives the same bits on all instruction sets; only the speed differs. Values only
/// come from [`Self::best`] and [`Self::available`], so a value proves that the set was detected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Isa(pub(crate) Kind);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// The instructions that the compilation target guarantees. It is fast only if these include a fused multiply-add.
    Portable,
    /// AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// AVX-512 F and VL, in addition to AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Isa {
    /// Returns the fastest instruction set.
    pub fn best() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            let avx2 =
                std::is_x86_feature_detected!("avx2") && std::is_x86_feature_detected!("fma");
            let avx512 = std::is_x86_feature_detected!("avx512f")
                && std::is_x86_feature_detected!("avx512vl");
            if avx2 && avx512 {
                return Self(Kind::Avx512);
            }
            if avx2 {
                return Self(Kind::Avx2);
            }
        }
        Self(Kind::Portable)
    }

    /// Returns true if these are only the instructions that the compilation target guarantees, which every machine has.
    pub fn is_portable(self) -> bool {
        self.0 == Kind::Portable
    }

    /// Returns the name of the instruction set.
    pub fn name(self) -> &'static str {
        match self.0 {
            Kind::Portable => "portable",
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 => "avx2",
            #[cfg(target_arch = "x86_64")]
            Kind::Avx512 => "avx-512",
        }
    }

    /// Returns all available instruction sets, slowest first, for tests and comparisons.
    pub fn available() -> Vec<Self> {
        let mut all = vec![Self(Kind::Portable)];
        #[cfg(target_arch = "x86_64")]
        {
            let best = Self::best();
            if best.0 == Kind::Avx512 {
                all.push(Self(Kind::Avx2));
            }
            if best.0 != Kind::Portable {
                all.push(best);
            }
        }
        all
    }
}

impl Default for Isa {
    fn default() -> Self {
        Self::best()
    }
}
