//! The attraction between grains that lets a wall of them stand.

/// Height (diameters) of a wall that stands without attraction, as the gate `snow.grains.wall` measures it: at an angle of repose of 32
/// degrees, and its increase per degree below and per degree above that.
const FREE_HEIGHT: [f64; 3] = [6.2, 0.4, 0.15];
/// Measured attraction (weights of a grain) per diameter of further height, times the [`rankine_factor`]; and the increase of this rate per
/// diameter, as long chains of contacts are solved less accurately.
const ATTRACTION: [f64; 2] = [0.37, 0.0045];

/// The attraction (weights of a grain) with which a wall of a height (m), with grains of a diameter (m) and an angle of repose (degrees),
/// just stands; 0 if it stands without. By Rankine the critical height is 4 c tan(45 + a/2) / (rho g), and the cohesion c is tan(a) times a
/// tensile strength that is proportional to the attraction (Rumpf 1962).
pub fn of_wall(height: f64, diameter: f64, repose: f64) -> f64 {
    let extra = (height / diameter - free_height(repose)).max(0.0);
    (ATTRACTION[0] + ATTRACTION[1] * extra) * extra / rankine_factor(repose)
}

/// The height (m) of the wall that just stands with an attraction; the inverse of [`of_wall`].
pub fn wall_of(attraction: f64, diameter: f64, repose: f64) -> f64 {
    let root =
        (ATTRACTION[0] * ATTRACTION[0] + 4.0 * ATTRACTION[1] * attraction * rankine_factor(repose)).sqrt();
    (free_height(repose) + (root - ATTRACTION[0]) / (2.0 * ATTRACTION[1])) * diameter
}

/// Height (diameters) of a wall that stands without attraction.
fn free_height(repose: f64) -> f64 {
    let repose = repose.max(MIN_REPOSE);
    FREE_HEIGHT[0] + FREE_HEIGHT[1] * (32.0 - repose).max(0.0) + FREE_HEIGHT[2] * (repose - 32.0).max(0.0)
}

/// tan(a) tan(45 degrees + a/2) of an angle of repose a (degrees).
fn rankine_factor(repose: f64) -> f64 {
    let angle = repose.max(MIN_REPOSE).to_radians();
    libm::tan(angle) * libm::tan(std::f64::consts::FRAC_PI_4 + 0.5 * angle)
}

/// Minimum angle of repose (degrees) that is used: without friction no attraction would be enough.
const MIN_REPOSE: f64 = 10.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wall_of_is_the_inverse_of_of_wall() {
        for (height, repose) in [(0.3, 32.0), (0.1, 38.0), (1.5, 5.0)] {
            let attraction = of_wall(height, 0.005, repose);
            assert!((wall_of(attraction, 0.005, repose) - height).abs() < 1e-9, "{height}");
        }
    }
}
