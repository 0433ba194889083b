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

/// Calls a function's copy for the instruction set in use.
macro_rules! dispatch {
    ($body:ident($($name:ident: $kind:ty),*) $(-> $out:ty)?) => {{
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx2")]
        fn avx2($($name: $kind),*) $(-> $out)? {
            $body($($name),*)
        }
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw")]
        fn avx512($($name: $kind),*) $(-> $out)? {
            $body($($name),*)
        }
        match $crate::base::cpu::cpu_level() {
            // SAFETY: the level was detected on this processor.
            #[cfg(target_arch = "x86_64")]
            $crate::base::cpu::CpuLevel::Avx512 => unsafe { avx512($($name),*) },
            // SAFETY: the level was detected on this processor.
            #[cfg(target_arch = "x86_64")]
            $crate::base::cpu::CpuLevel::Avx2 => unsafe { avx2($($name),*) },
            _ => $body($($name),*),
        }
    }};
}
pub(crate) use dispatch;
