//! The attraction between grains that lets a wall of them stand.

/// Height (diameters) of a wall that stands by the grains' size alone, as the gate `snow.grains.wall` measures it: at an angle of
/// repose of 32 degrees, and for each degree below and above that.
const ALONE: [f64; 3] = [5.5, 0.3, 0.4];
/// Measured attraction (weights of a grain) times tan(a) tan(45 degrees + a/2) for each further diameter, a the angle of repose,
/// and what each of these makes the next ones need more: long chains of contacts are solved less exactly.
const EACH: [f64; 2] = [0.37, 0.0045];

/// The attraction (weights of a grain) with which a wall of a height (m) of grains of a diameter (m) and an angle of repose
/// (degrees) just stands; 0 where it stands without. By Rankine the critical height is 4 c tan(45 + a/2) / (rho g), and the
/// cohesion c is tan(a) times a tensile strength, which is proportional to the attraction (Rumpf 1962).
pub fn of_wall(height: f64, diameter: f64, repose: f64) -> f64 {
    let repose = repose.max(GENTLEST);
    let angle = repose.to_radians();
    let shape = libm::tan(angle) * libm::tan(std::f64::consts::FRAC_PI_4 + 0.5 * angle);
    let alone = ALONE[0] + ALONE[1] * (32.0 - repose).max(0.0) + ALONE[2] * (repose - 32.0).max(0.0);
    let more = (height / diameter - alone).max(0.0);
    (EACH[0] + EACH[1] * more) * more / shape
}

/// Least angle of repose (degrees) that counts: without friction no attraction would do.
const GENTLEST: f64 = 10.0;
