//! How long this machine takes for a fixed mix of work, over the machine on which the bounds of times were set: bounds of
//! seconds mean the same on both.

use std::hint::black_box;
use std::sync::OnceLock;
use std::time::Instant;

/// Seconds of the two kernels on the machine of the bounds: one core of an AMD EPYC with AVX2 in a virtual machine.
const ARITHMETIC_SECONDS: f64 = 0.0190;
const MEMORY_SECONDS: f64 = 0.0084;

/// Measured once a run: over 1 where this machine is slower than the one of the bounds, on one thread.
pub fn slowness() -> f64 {
    static MEASURED: OnceLock<f64> = OnceLock::new();
    *MEASURED.get_or_init(|| {
        let arithmetic = fastest(arithmetic_kernel()) / ARITHMETIC_SECONDS;
        let memory = fastest(memory_kernel()) / MEMORY_SECONDS;
        let slowness = (arithmetic * memory).sqrt();
        println!(
            "# calibration: {slowness:.3} times as slow as the machine of the bounds (arithmetic {arithmetic:.3}, memory \
             {memory:.3}); gates of times are divided by it, gates of rates are multiplied"
        );
        slowness
    })
}

/// The least of 15 times: what other processes do only adds to it.
fn fastest(mut kernel: impl FnMut()) -> f64 {
    (0..15).fold(f64::INFINITY, |least, _| {
        let start = Instant::now();
        kernel();
        least.min(start.elapsed().as_secs_f64())
    })
}

/// Sums, products, a root and a quotient of 4,096 numbers, which fit in the first cache, 8,000 times.
fn arithmetic_kernel() -> impl FnMut() {
    let mut values: Vec<f32> = (0..4096).map(|n| 1.0 + n as f32 / 4096.0).collect();
    move || {
        for _ in 0..8000 {
            for value in black_box(&mut values[..]) {
                *value = (*value * 0.75 + 0.5).sqrt() + 1.0 / (*value + 2.0);
            }
        }
    }
}

/// One sum of two arrays of 64 MB, which fit in no cache, into a third.
fn memory_kernel() -> impl FnMut() {
    let [a, b] = [1.0f32, 2.0].map(|value| vec![value; 16 << 20]);
    let mut sum = vec![0.0f32; 16 << 20];
    move || {
        for ((sum, a), b) in black_box(&mut sum[..]).iter_mut().zip(&a).zip(&b) {
            *sum = a + 0.5 * b;
        }
    }
}
