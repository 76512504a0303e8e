//! Extent of the measurements of each camera on its sensor.

use super::tables::{Camera, Table, Tables};

/// Measurements of an image that count as independent of each other: matches stand in heaps, and an image has four
/// quarters.
const PER_IMAGE: usize = 4;
/// Share of the images whose farthest measurement is left out of [`Extent::filled`]: blunders reach anywhere.
const STRAYS: f64 = 0.05;
/// How far beyond the edge of the sensor a good measurement may lie, px: a corner whose centre is extrapolated.
pub const EDGE_PX: f64 = 2.0;

/// Where the measurements of one camera lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Number of measurements.
    pub count: usize,
    /// Number of images that have one.
    pub images: usize,
    /// Number of measurements that count as independent.
    pub independent: usize,
    /// Least coordinates, px.
    pub low: [f64; 2],
    /// Greatest coordinates, px.
    pub high: [f64; 2],
    /// Greatest coordinates without those of a few images, px.
    pub filled: [f64; 2],
    /// Measurements beyond the right, and beyond the lower edge of the sensor.
    pub beyond: [usize; 2],
    /// Measurements before the left or the upper edge.
    pub before: usize,
}

impl Extent {
    const NONE: Self = Self {
        count: 0,
        images: 0,
        independent: 0,
        low: [f64::INFINITY; 2],
        high: [f64::NEG_INFINITY; 2],
        filled: [f64::NEG_INFINITY; 2],
        beyond: [0; 2],
        before: 0,
    };

    fn add(&mut self, xy: [f64; 2], sides: [f64; 2]) {
        self.count += 1;
        for axis in 0..2 {
            self.low[axis] = self.low[axis].min(xy[axis]);
            self.high[axis] = self.high[axis].max(xy[axis]);
            self.beyond[axis] += usize::from(xy[axis] > sides[axis] + EDGE_PX);
        }
        self.before += usize::from(xy.iter().any(|value| *value < -EDGE_PX));
    }

    /// Two tables of the same camera as one; images are counted as if they were the same.
    pub fn with(&self, other: &Self) -> Self {
        Self {
            count: self.count + other.count,
            images: self.images.max(other.images),
            independent: self.independent.max(other.independent),
            low: [0, 1].map(|axis| self.low[axis].min(other.low[axis])),
            high: [0, 1].map(|axis| self.high[axis].max(other.high[axis])),
            filled: [0, 1].map(|axis| self.filled[axis].max(other.filled[axis])),
            beyond: [0, 1].map(|axis| self.beyond[axis] + other.beyond[axis]),
            before: self.before + other.before,
        }
    }

    /// Largest absolute value of a coordinate; zero without measurements.
    pub fn reach(&self) -> f64 {
        let values = self.low.iter().chain(&self.high).map(|value| value.abs());
        if self.count == 0 { 0.0 } else { values.fold(0.0, f64::max) }
    }
}

/// Extent of a table's measurements, by camera.
pub fn of(table: &Table, tables: &Tables) -> Vec<Extent> {
    let mut extents = vec![Extent::NONE; tables.cameras.len()];
    let mut in_image = vec![0; tables.images.len()];
    let mut farthest = vec![[f64::NEG_INFINITY; 2]; tables.images.len()];
    for row in table.iter() {
        let camera = tables.images[row.image].camera;
        extents[camera].add(row.xy, tables.cameras[camera].sides);
        in_image[row.image] += 1;
        farthest[row.image] = [0, 1].map(|axis| farthest[row.image][axis].max(row.xy[axis]));
    }
    for (image, count) in tables.images.iter().zip(&in_image) {
        extents[image.camera].images += usize::from(*count > 0);
        extents[image.camera].independent += (*count).min(PER_IMAGE);
    }
    for (camera, extent) in extents.iter_mut().enumerate() {
        let own = tables.images.iter().zip(&in_image).zip(&farthest);
        let own = own.filter(|((image, count), _)| image.camera == camera && **count > 0);
        let own: Vec<[f64; 2]> = own.map(|(_, farthest)| *farthest).collect();
        extent.filled = [0, 1].map(|axis| without_strays(own.iter().map(|farthest| farthest[axis]).collect()));
    }
    extents
}

/// The greatest value, after a share of [`STRAYS`] is left out.
fn without_strays(mut values: Vec<f64>) -> f64 {
    values.sort_by(|a, b| b.total_cmp(a));
    let left_out = (STRAYS * values.len() as f64) as usize;
    values.get(left_out).copied().unwrap_or(f64::NEG_INFINITY)
}

/// Cameras by what a check says of their measurements, in the order in which it is said first.
pub fn by_finding<T: PartialEq>(
    tables: &Tables,
    extents: &[Extent],
    check: impl Fn(&Camera, &Extent) -> Option<T>,
) -> Vec<(T, Vec<usize>)> {
    let mut groups: Vec<(T, Vec<usize>)> = Vec::new();
    for (k, (camera, extent)) in tables.cameras.iter().zip(extents).enumerate() {
        let Some(found) = check(camera, extent) else { continue };
        match groups.iter_mut().find(|(known, _)| *known == found) {
            Some((_, cameras)) => cameras.push(k),
            None => groups.push((found, vec![k])),
        }
    }
    groups
}

/// Images of some cameras; empty where no other camera has measurements.
pub fn images(tables: &Tables, extents: &[Extent], cameras: &[usize]) -> Vec<String> {
    let others = extents.iter().enumerate().any(|(k, extent)| extent.count > 0 && !cameras.contains(&k));
    if others { tables.images_of(cameras) } else { Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::super::tables::made;
    use super::*;

    #[test]
    fn extents_are_those_of_the_rows_of_each_camera() {
        let mut tables = made::tables();
        tables.cameras.push(Camera { id: "other".into(), ..made::camera() });
        let extents = of(&tables.ties, &tables);
        assert_eq!((extents[0].count, extents[0].images, extents[0].independent), (500, 10, 40));
        assert!(extents[0].low.iter().all(|low| (0.0..100.0).contains(low)), "{extents:?}");
        assert!(extents[0].high[0] > 3900.0 && extents[0].high[1] > 2900.0);
        assert_eq!((extents[0].beyond, extents[0].before), ([0, 0], 0));
        assert_eq!((extents[1], extents[1].reach()), (Extent::NONE, 0.0));
        assert_eq!(extents[0].with(&extents[1]), extents[0]);
    }

    #[test]
    fn one_stray_in_many_images_is_left_out() {
        let mut values: Vec<f64> = (0..20).map(f64::from).collect();
        assert_eq!(without_strays(values.clone()), 18.0);
        values.truncate(10);
        assert_eq!(without_strays(values), 9.0);
        assert_eq!(without_strays(Vec::new()), f64::NEG_INFINITY);
    }

    #[test]
    fn images_are_named_where_another_camera_is_measured_too() {
        let mut tables = made::tables();
        tables.cameras.push(Camera { id: "other".into(), ..made::camera() });
        let alone = of(&tables.ties, &tables);
        assert!(images(&tables, &alone, &[0]).is_empty());
        tables.images[3].camera = 1;
        let both = of(&tables.ties, &tables);
        assert_eq!(images(&tables, &both, &[1]), ["i3"]);
        let groups = by_finding(&tables, &both, |_, extent| (extent.count > 0).then_some(()));
        assert_eq!(groups, [((), vec![0, 1])]);
    }
}
