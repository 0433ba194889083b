//! Liquids that merge, split, tear, close and swirl, and whose every particle's way is known.

use std::f64::consts::PI;

use frazil::geometry::{DVec3, TriMesh};

use super::liquids::filled;
use super::shapes::sphere;

/// A liquid that changes its topology: its name, its particles at the first frame, and where a position of that frame is at
/// another (frames; all positions in spacings).
pub struct Set {
    pub name: &'static str,
    pub positions: Vec<DVec3>,
    pub motion: fn(DVec3, f64) -> DVec3,
}

/// Two balls, a dumbbell, a sheet and a bubble.
pub fn sets() -> [Set; 4] {
    let within = |size: f64, is_inside: &dyn Fn(DVec3) -> bool| filled(1.0, 0.1, size, is_inside);
    let ball = |at: f64| move |p: DVec3| (p - DVec3::new(at, 0.0, 0.0)).norm() < 5.0;
    [
        Set {
            name: "two balls meet",
            positions: within(13.0, &|p| ball(-7.0)(p) || ball(7.0)(p)),
            motion: |p, t| p - DVec3::new(0.15 * t * p.x.signum(), 0.0, 0.0),
        },
        Set {
            name: "a dumbbell pinches",
            positions: within(14.0, &|p| {
                ball(-8.0)(p) || ball(8.0)(p) || p.x.abs() < 8.0 && p.yz().norm() < 2.5
            }),
            // Drawn out between the balls, which keep their shape.
            motion: |p, t| {
                let long = libm::exp(0.04 * t);
                let (inner, thin) = (p.x.clamp(-5.0, 5.0), 1.0 / long.sqrt());
                let share = (1.0 - (p.x.abs() - 3.0) / 3.0).clamp(0.0, 1.0);
                let width = 1.0 + (thin - 1.0) * share;
                DVec3::new(p.x + inner * (long - 1.0), p.y * width, p.z * width)
            },
        },
        Set {
            name: "a sheet tears",
            positions: within(14.0, &|p| p.y.abs() < 1.6),
            motion: |p, t| {
                let wide = libm::exp(0.03 * t);
                DVec3::new(p.x * wide, p.y / (wide * wide), p.z * wide)
            },
        },
        Set {
            name: "a bubble closes",
            positions: within(12.0, &|p| (5.5..12.0).contains(&p.norm())),
            motion: |p, t| {
                let cube = p.norm().powi(3);
                p * ((cube - (4.0 * t).min(cube)) / cube).max(0.0).cbrt()
            },
        },
    ]
}

/// The ball that Enright et al. (2002) put into the flow of LeVeque (1996) in the unit box: two vortices draw it out into a thin
/// sheet until half of the period; then they turn back, and all comes to where it was.
pub struct Vortex {
    /// Initial distance between particles (m).
    pub spacing: f64,
    /// Particles at time 0 (m).
    pub positions: Vec<DVec3>,
    /// The ball's surface at time 0 (m).
    pub mesh: TriMesh,
}

impl Vortex {
    /// When the flow has taken everything back (s).
    pub const PERIOD: f64 = 3.0;
    /// The ball's radius (m).
    pub const RADIUS: f64 = 0.15;
    /// The ball's centre on each axis (m).
    pub const CENTRE: f64 = 0.35;

    /// With about so many particles, and a mesh of 12 n^2 triangles.
    pub fn new(particles: usize, n: usize) -> Self {
        let centre = DVec3::repeat(Self::CENTRE);
        let volume = 4.0 / 3.0 * PI * Self::RADIUS * Self::RADIUS * Self::RADIUS;
        let spacing = libm::cbrt(volume / particles as f64);
        let ball = filled(spacing, 0.1, Self::RADIUS, |position| position.norm() <= Self::RADIUS);
        let positions = ball.iter().map(|position| position + centre).collect();
        let mut mesh = sphere(Self::RADIUS as f32, n);
        mesh.positions.iter_mut().for_each(|position| *position = (position.cast::<f64>() + centre).cast());
        Self { spacing, positions, mesh }
    }

    /// How fast the liquid moves (m/s) at a position (m) and a time (s).
    pub fn velocity(position: DVec3, time: f64) -> DVec3 {
        let (sine, cosine) = (position.map(|x| libm::sin(PI * x)), position.map(|x| libm::cos(PI * x)));
        let (once, twice) = (sine.component_mul(&sine), 2.0 * sine.component_mul(&cosine));
        let x = 2.0 * once.x * twice.y * twice.z;
        let y = -twice.x * once.y * twice.z;
        let z = -twice.x * twice.y * once.z;
        DVec3::new(x, y, z) * libm::cos(PI * time / Self::PERIOD)
    }

    /// Moves positions (m) on from one time to another (s), in so many steps of Runge and Kutta's fourth order: four in 1/24 s leave
    /// them off by less than 1e-6 m.
    pub fn carry(positions: &mut [DVec3], [from, to]: [f64; 2], steps: u32) {
        let dt = (to - from) / f64::from(steps);
        for position in positions {
            for step in 0..steps {
                let (at, begin) = (*position, from + dt * f64::from(step));
                let a = Self::velocity(at, begin);
                let b = Self::velocity(at + a * (0.5 * dt), begin + 0.5 * dt);
                let c = Self::velocity(at + b * (0.5 * dt), begin + 0.5 * dt);
                let d = Self::velocity(at + c * dt, begin + dt);
                *position = at + (a + (b + c) * 2.0 + d) * (dt / 6.0);
            }
        }
    }
}
