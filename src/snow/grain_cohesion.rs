//! The attraction between grains that lets a wall of them stand.

/// Height (diameters) of a wall that stands without attraction, as the gate `snow.grains.wall` measures it: at an angle of repose of 32
/// degrees, and how much it grows with each degree below and with each degree above that.
const ALONE: [f64; 3] = [6.2, 0.4, 0.15];
/// Measured attraction (weights of a grain), times tan(a) tan(45 degrees + a/2), where a is the angle of repose, for each further diameter;
/// and its increase with each diameter: long chains of contacts are solved less accurately.
const EACH: [f64; 2] = [0.37, 0.0045];

/// The attraction (weights of a grain) with which a wall of a height (m), with grains of a diameter (m) and an angle of repose (degrees),
/// just stands; 0 if it stands without. By Rankine the critical height is 4 c tan(45 + a/2) / (rho g), and the cohesion c is tan(a) times a
/// tensile strength that is proportional to the attraction (Rumpf 1962).
pub fn of_wall(height: f64, diameter: f64, repose: f64) -> f64 {
    let more = (height / diameter - alone(repose)).max(0.0);
    (EACH[0] + EACH[1] * more) * more / shape(repose)
}

/// The height (m) of the wall that just stands with an attraction; the inverse of [`of_wall`].
pub fn wall_of(attraction: f64, diameter: f64, repose: f64) -> f64 {
    let root = (EACH[0] * EACH[0] + 4.0 * EACH[1] * attraction * shape(repose)).sqrt();
    (alone(repose) + (root - EACH[0]) / (2.0 * EACH[1])) * diameter
}

/// Height (diameters) of a wall that stands without attraction.
fn alone(repose: f64) -> f64 {
    let repose = repose.max(GENTLEST);
    ALONE[0] + ALONE[1] * (32.0 - repose).max(0.0) + ALONE[2] * (repose - 32.0).max(0.0)
}

/// tan(a) tan(45 degrees + a/2) of an angle of repose a (degrees).
fn shape(repose: f64) -> f64 {
    let angle = repose.max(GENTLEST).to_radians();
    libm::tan(angle) * libm::tan(std::f64::consts::FRAC_PI_4 + 0.5 * angle)
}

/// Minimum angle of repose (degrees) that is used: without friction no attraction would be enough.
const GENTLEST: f64 = 10.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_height_gives_the_attraction_that_gives_it() {
        for (height, repose) in [(0.3, 32.0), (0.1, 38.0), (1.5, 5.0)] {
            let attraction = of_wall(height, 0.005, repose);
            assert!((wall_of(attraction, 0.005, repose) - height).abs() < 1e-9, "{height}");
        }
    }
}
