//! A point that moves at constant velocity, estimated from noisy positions.

use nalgebra::{Matrix3, Matrix6, Matrix6x3, Vector3, Vector6};

/// Standard deviation of the acceleration that the model leaves out, m/s².
const ACCELERATION: f64 = 3.0;
/// Standard deviation of the velocity of what was seen once, m/s per axis: where
/// nothing is known, and around what most things do. As likely as a walker among
/// what stands is what keeps its place before the camera: a car ahead.
const FIRST_VELOCITY: f64 = 10.0;
const OWN_VELOCITY: f64 = 3.0;
/// Added to every measured variance, m²: a tracked point is not a rigid one.
const FLOOR: f64 = 1e-6;

/// Constant-velocity Kalman filter (Kalman 1960) over position and velocity in
/// the left optical frame; metres and seconds.
#[derive(Clone, Debug)]
pub struct Kalman {
    state: Vector6<f64>,
    covariance: Matrix6<f64>,
}

impl Kalman {
    /// The filter after a first position, of a point of which the `expected` velocity
    /// (m/s) is known or nothing; `None` when the position is no measurement.
    pub fn new(
        position: &[f64; 3],
        covariance: &[f64; 9],
        expected: Option<&[f64; 3]>,
    ) -> Option<Self> {
        let (position, noise) = measurement(position, covariance)?;
        let mut state = Vector6::zeros();
        state.fixed_rows_mut::<3>(0).copy_from(&position);
        let mut p = Matrix6::zeros();
        p.fixed_view_mut::<3, 3>(0, 0).copy_from(&noise);
        for axis in 0..3 {
            let velocity = expected.map(|velocity| velocity[axis]);
            state[3 + axis] = velocity.unwrap_or(0.0);
            p[(3 + axis, 3 + axis)] =
                velocity.map_or(FIRST_VELOCITY.powi(2), |v| OWN_VELOCITY.powi(2) + v * v);
        }
        Some(Self { state, covariance: p })
    }

    /// Moves the estimate `dt` seconds ahead: F = [I, dt I; 0, I] and white
    /// noise acceleration, Q = σ² [dt⁴/4, dt³/2; dt³/2, dt²].
    pub fn predict(&mut self, dt: f64) {
        let mut f = Matrix6::identity();
        f.fixed_view_mut::<3, 3>(0, 3).fill_diagonal(dt);
        self.state = f * self.state;
        self.covariance = f * self.covariance * f.transpose();
        let (s, dt2) = (ACCELERATION * ACCELERATION, dt * dt);
        for i in 0..3 {
            self.covariance[(i, i)] += s * dt2 * dt2 / 4.0;
            self.covariance[(i, i + 3)] += s * dt2 * dt / 2.0;
            self.covariance[(i + 3, i)] += s * dt2 * dt / 2.0;
            self.covariance[(i + 3, i + 3)] += s * dt2;
        }
    }

    /// Squared Mahalanobis distance of a measured position from the estimate:
    /// chi-squared with 3 degrees of freedom when they are the same point.
    /// `None` when there is no measurement.
    pub fn distance(&self, position: &[f64; 3], covariance: &[f64; 9]) -> Option<f64> {
        let (position, noise) = measurement(position, covariance)?;
        let residual = position - self.state.fixed_rows::<3>(0);
        let inverse = (self.covariance.fixed_view::<3, 3>(0, 0) + noise).try_inverse()?;
        Some((residual.transpose() * inverse * residual)[0])
    }

    /// Takes a measured position in; without effect when it is no measurement.
    pub fn update(&mut self, position: &[f64; 3], covariance: &[f64; 9]) {
        let Some((position, noise)) = measurement(position, covariance) else { return };
        let s = self.covariance.fixed_view::<3, 3>(0, 0) + noise;
        let Some(inverse) = s.try_inverse() else { return };
        let cross: Matrix6x3<f64> = self.covariance.fixed_columns::<3>(0).into_owned();
        let gain = cross * inverse;
        self.state += gain * (position - self.state.fixed_rows::<3>(0));
        self.covariance -= gain * cross.transpose();
        // Rounding must not let the two halves drift apart.
        self.covariance = (self.covariance + self.covariance.transpose()) * 0.5;
    }

    /// Estimated position, metres.
    pub fn position(&self) -> [f64; 3] {
        [self.state[0], self.state[1], self.state[2]]
    }

    /// Covariance of the estimated position, row-major, m².
    pub fn position_covariance(&self) -> [f64; 9] {
        std::array::from_fn(|i| self.covariance[(i / 3, i % 3)])
    }

    /// Variance of the estimated velocity along the axis it is known least, m²/s².
    pub fn velocity_variance(&self) -> f64 {
        (3..6).map(|i| self.covariance[(i, i)]).fold(0.0, f64::max)
    }

    /// Estimated velocity, m/s.
    pub fn velocity(&self) -> [f64; 3] {
        [self.state[3], self.state[4], self.state[5]]
    }
}

fn measurement(position: &[f64; 3], covariance: &[f64; 9]) -> Option<(Vector3<f64>, Matrix3<f64>)> {
    let finite = position.iter().chain(covariance).all(|v| v.is_finite());
    finite.then(|| {
        let mut noise = Matrix3::from_row_slice(covariance);
        for i in 0..3 {
            noise[(i, i)] += FLOOR;
        }
        (Vector3::from(*position), noise)
    })
}
