//! Which vector instructions the hot kernels use: chosen once at run time, never at compile time.

use std::sync::OnceLock;

/// A set of vector instructions; results are the same bits at every level.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum CpuLevel {
    /// Plain x86-64 (SSE2), or another processor's own baseline.
    Baseline,
    /// AVX2.
    Avx2,
    /// AVX-512 F, VL, DQ and BW.
    Avx512,
}

/// The level in use: the highest that the processor has, or a lower one that the environment
/// variable `FRAZIL_CPU` (`baseline`, `avx2`, `avx512`) names for tests.
pub fn cpu_level() -> CpuLevel {
    static LEVEL: OnceLock<CpuLevel> = OnceLock::new();
    *LEVEL.get_or_init(|| {
        let available = detect();
        let Ok(wanted) = std::env::var("FRAZIL_CPU") else { return available };
        let wanted = match wanted.as_str() {
            "baseline" => CpuLevel::Baseline,
            "avx2" => CpuLevel::Avx2,
            "avx512" => CpuLevel::Avx512,
            other => {
                log::warn!("FRAZIL_CPU={other} is not baseline, avx2 or avx512: ignored");
                available
            }
        };
        wanted.min(available)
    })
}

#[cfg(target_arch = "x86_64")]
fn detect() -> CpuLevel {
    let avx512 = is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512vl")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512bw");
    match (is_x86_feature_detected!("avx2"), avx512) {
        (true, true) => CpuLevel::Avx512,
        (true, false) => CpuLevel::Avx2,
        _ => CpuLevel::Baseline,
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn detect() -> CpuLevel {
    CpuLevel::Baseline
}

/// Calls the copy of a function that is compiled for the instruction set in use. `at most avx2` makes no AVX-512 copy, for functions that
/// wider vectors do not make faster. The function may be a type's (`Rows::run`) and have generic arguments (`solve::<true>`).
macro_rules! dispatch {
    (at most avx2: $body:ident $(::$path:ident)* $(::<$($generic:tt),+>)?
        ($($name:ident: $kind:ty),*) $(-> $out:ty)?) => {{
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx2")]
        fn avx2($($name: $kind),*) $(-> $out)? {
            $body $(::$path)* $(::<$($generic),+>)? ($($name),*)
        }
        match $crate::numeric::cpu::cpu_level() {
            // SAFETY: the level was detected on this processor.
            #[cfg(target_arch = "x86_64")]
            $crate::numeric::cpu::CpuLevel::Avx512 | $crate::numeric::cpu::CpuLevel::Avx2 => unsafe {
                avx2($($name),*)
            },
            _ => $body $(::$path)* $(::<$($generic),+>)? ($($name),*),
        }
    }};
    ($body:ident $(::$path:ident)* $(::<$($generic:tt),+>)?($($name:ident: $kind:ty),*) $(-> $out:ty)?) => {{
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx2")]
        fn avx2($($name: $kind),*) $(-> $out)? {
            $body $(::$path)* $(::<$($generic),+>)? ($($name),*)
        }
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw")]
        fn avx512($($name: $kind),*) $(-> $out)? {
            $body $(::$path)* $(::<$($generic),+>)? ($($name),*)
        }
        match $crate::numeric::cpu::cpu_level() {
            // SAFETY: the level was detected on this processor.
            #[cfg(target_arch = "x86_64")]
            $crate::numeric::cpu::CpuLevel::Avx512 => unsafe { avx512($($name),*) },
            // SAFETY: the level was detected on this processor.
            #[cfg(target_arch = "x86_64")]
            $crate::numeric::cpu::CpuLevel::Avx2 => unsafe { avx2($($name),*) },
            _ => $body $(::$path)* $(::<$($generic),+>)? ($($name),*),
        }
    }};
}
pub(crate) use dispatch;

/// Denormal numbers count as 0 on this thread until this is dropped: some processors take a hundred times longer for them. The same on
/// every thread, so that results do not depend on which thread does the work.
pub struct FlushDenormals {
    #[cfg(target_arch = "x86_64")]
    before: u32,
}

/// Bits of the SSE control register: denormal results and denormal operands are 0.
#[cfg(target_arch = "x86_64")]
const FLUSH: u32 = 1 << 15 | 1 << 6;

impl FlushDenormals {
    /// Begins to flush; other settings (rounding, exceptions) have their defaults meanwhile.
    pub fn begin() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            /// All exceptions masked, rounding to nearest: the state that programs start with.
            const DEFAULT: u32 = 0x1f80;
            let before = control();
            set_control(DEFAULT | FLUSH);
            Self { before }
        }
        #[cfg(not(target_arch = "x86_64"))]
        Self {}
    }
}

impl Drop for FlushDenormals {
    fn drop(&mut self) {
        #[cfg(target_arch = "x86_64")]
        set_control(self.before);
    }
}

#[cfg(target_arch = "x86_64")]
fn control() -> u32 {
    let mut value = 0u32;
    // SAFETY: writes the four bytes of `value` and nothing else.
    unsafe { std::arch::asm!("stmxcsr [{}]", in(reg) &mut value, options(nostack, preserves_flags)) };
    value
}

#[cfg(target_arch = "x86_64")]
fn set_control(value: u32) {
    // SAFETY: reads four bytes; only rounding, flushing and exception masks change, and no exception is unmasked that was masked before.
    unsafe { std::arch::asm!("ldmxcsr [{}]", in(reg) &value, options(nostack, preserves_flags, readonly)) };
}
