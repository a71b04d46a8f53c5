//! A smooth function of two variables through given values: a polyharmonic spline.
//!
//! Sums of cubed distances and a linear part: twice continuously differentiable, and of all such
//! functions the least bent, as thin plates are, but without a logarithm. It depends on where the
//! values are given alone, not on a mesh.
//!
//! Source: Duchon 1977, Splines minimizing rotation-invariant semi-norms in Sobolev spaces.

use glam::DVec2;

/// Sites closer than this part of the unit are one.
const APART: f64 = 1e-4;
/// Gives way to the noise of sites that are all but one, and keeps the system solvable.
const GIVE: f64 = 1e-10;

/// A value at a place.
#[derive(Clone, Copy, Debug)]
pub struct Site {
    pub place: DVec2,
    pub value: f64,
    /// How easily it is missed, as a cubed length: 0 if it must be met.
    pub give: f64,
}

/// A function of the plane.
pub struct Spline {
    sites: Vec<DVec2>,
    weights: Vec<f64>,
    /// Constant, then the factors of the coordinates.
    linear: [f64; 3],
}

impl Spline {
    /// The function with these values, within what they give way; sites lie within a few units.
    /// `None` if they are on a line.
    pub fn through(given: &[Site]) -> Option<Self> {
        let mut sites: Vec<DVec2> = Vec::with_capacity(given.len());
        let mut taken = Vec::with_capacity(given.len());
        for site in given {
            if sites.iter().all(|other| other.distance_squared(site.place) > APART * APART) {
                sites.push(site.place);
                taken.push(site);
            }
        }
        let count = sites.len();
        let size = count + 3;
        // Rows of the matrix with the right side as the last column.
        let mut rows = vec![vec![0.0; size + 1]; size];
        for i in 0..count {
            for j in 0..count {
                rows[i][j] = kernel(sites[i].distance_squared(sites[j]));
            }
            rows[i][i] += GIVE + taken[i].give;
            for (k, term) in [1.0, sites[i].x, sites[i].y].into_iter().enumerate() {
                rows[i][count + k] = term;
                rows[count + k][i] = term;
            }
            rows[i][size] = taken[i].value;
        }
        let mut weights = solve(rows)?;
        let linear = [weights[count], weights[count + 1], weights[count + 2]];
        weights.truncate(count);
        Some(Self { sites, weights, linear })
    }

    pub fn at(&self, place: DVec2) -> f64 {
        let [constant, x, y] = self.linear;
        let terms = self.sites.iter().zip(&self.weights);
        let sum: f64 =
            terms.map(|(site, weight)| weight * kernel(site.distance_squared(place))).sum();
        sum + constant + x * place.x + y * place.y
    }
}

fn kernel(square: f64) -> f64 {
    square * square.sqrt()
}

/// Gauss with the largest pivot of each column.
fn solve(mut rows: Vec<Vec<f64>>) -> Option<Vec<f64>> {
    let size = rows.len();
    for column in 0..size {
        let pivot = (column..size)
            .max_by(|&a, &b| rows[a][column].abs().total_cmp(&rows[b][column].abs()))?;
        rows.swap(column, pivot);
        let (upper, lower) = rows.split_at_mut(column + 1);
        let top = &upper[column];
        if top[column].abs() < 1e-14 || !top[column].is_finite() {
            return None;
        }
        for row in lower {
            let factor = row[column] / top[column];
            for (value, above) in row[column..].iter_mut().zip(&top[column..]) {
                *value -= factor * above;
            }
        }
    }
    let mut solution = vec![0.0; size];
    for i in (0..size).rev() {
        let known: f64 = (i + 1..size).map(|j| rows[i][j] * solution[j]).sum();
        solution[i] = (rows[i][size] - known) / rows[i][i];
    }
    solution.iter().all(|value: &f64| value.is_finite()).then_some(solution)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exact(place: DVec2, value: f64) -> Site {
        Site { place, value, give: 0.0 }
    }

    #[test]
    fn values_are_met_and_linear_functions_reproduced() {
        let value = |p: DVec2| 3.0 - 2.0 * p.x + 0.5 * p.y;
        let sites: Vec<DVec2> =
            (0..40).map(|i| DVec2::new(f64::from(i % 7), f64::from(i / 7)) / 5.0).collect();
        let given: Vec<_> = sites.iter().map(|&p| exact(p, value(p))).collect();
        let plane = Spline::through(&given).expect("enough sites");
        let between = DVec2::new(0.513, 0.377);
        assert!((plane.at(between) - value(between)).abs() < 1e-9);
        let bumps: Vec<_> = sites.iter().map(|&p| exact(p, p.x * p.x * p.y)).collect();
        let spline = Spline::through(&bumps).expect("enough sites");
        for Site { place, value, .. } in bumps {
            assert!((spline.at(place) - value).abs() < 1e-7);
        }
    }

    #[test]
    fn sites_on_a_line_give_no_function() {
        let line: Vec<_> = (0..9).map(|i| exact(DVec2::splat(f64::from(i)), 1.0)).collect();
        assert!(Spline::through(&line).is_none());
    }
}
