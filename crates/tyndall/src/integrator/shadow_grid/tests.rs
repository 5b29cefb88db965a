use super::*;
use crate::math::Ray;
use crate::medium::MediumSettings;
use crate::transfer::{Optics, Point, TransferFunction};
use crate::volume::{ValueMap, Volume, Voxels};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Matter that is the same everywhere, up to all faces of a box with edges of different lengths.
fn block(dims: [usize; 3]) -> Medium {
    let grid = Grid::centred(dims, [1.0, 1.2, 0.9]).unwrap();
    let voxels = Voxels::U8(vec![1; dims.iter().product()]);
    let volume = Arc::new(Volume::new(grid, voxels, ValueMap::IDENTITY).unwrap());
    let transfer = TransferFunction::new(vec![Point {
        value: 0.0,
        optics: Optics { opacity: 1.0, ..Optics::default() },
    }]);
    let settings = MediumSettings::plain(0.05);
    Medium::new(volume, Arc::new(transfer.unwrap()), &settings)
}

#[test]
fn every_texel_of_even_matter_sees_every_point_as_far_as_matter_lets_it() {
    let medium = block([20, 9, 12]);
    let grid = medium.volume().grid();
    let layout = Layout::within(&medium, 8, 1 << 30).unwrap();
    // Inside, or straight beyond a face: beyond an edge of the box light has a kink between texels, where rays change the face by which they enter.
    let near = [
        [0.0, 0.0, 0.0],
        [7.3, -2.2, 3.1],
        [-9.9, 4.0, -5.0],
        [30.0, 1.0, 2.0],
        [-3.0, 2.0, 40.0],
        [3.0, -25.0, 2.0],
    ];
    let directions = [Vec3::new(0.3, -0.5, 0.8), Vec3::new(-1.0, 0.0, 0.0)].map(Vec3::normalize);
    let mut aims: Vec<Aim> = near.iter().map(|&p| layout.aim_at(grid, Vec3::from_array(p))).collect();
    aims.extend(directions.map(|d| layout.aim_towards(grid, d)));
    let mut shadows = ShadowGrid::new(layout, aims);
    let never = AtomicBool::new(false);
    assert!(shadows.complete(&medium, Level::best(), &Limits { cancel: &never, deadline: None }));
    let lattice = shadows.layout.lattice;
    let [nx, ny, nz] = lattice.texels();
    let (mut worst, mut compared) = (0.0_f32, 0);
    for i in 0..nx * ny * nz {
        let texel = [i % nx, i / nx % ny, i / (nx * ny)];
        let index = Vec3::from_array(std::array::from_fn(|a| lattice.index_at(a, texel[a] as f32)));
        let here = grid.index_to_world(index);
        let first = shadows.texel(texel).unwrap() * shadows.stride;
        for point in 0..near.len() + directions.len() {
            let (direction, distance) = match near.get(point) {
                Some(&p) => {
                    let way = Vec3::from_array(p) - here;
                    if way.length() < 0.5 {
                        continue;
                    }
                    (way.normalize(), way.length())
                }
                None => (directions[point - near.len()], f32::INFINITY),
            };
            // Where light grazes a face, one of the rays beside a texel on it is outside.
            let along = (grid.direction_to_index(direction) / Vec3::from_array(lattice.spacing())).abs();
            let is_beside = |a: usize| texel[a] == 0 || texel[a] + 1 == lattice.texels()[a];
            if (0..3).any(|a| is_beside(a) && along[a] < along.max_element()) {
                continue;
            }
            let exact = (-0.05 * medium.track(&Ray::new(here, direction), distance).length()).exp();
            let off = (f32::from(shadows.texels[first + point]) / FULL - exact).abs();
            assert!(off < 0.0125, "texel {texel:?}, point {point}: {off} off {exact}");
            worst = worst.max(off);
            compared += 1;
        }
    }
    println!("at most {worst} off");
    assert!(compared > 7 * nx * ny * nz, "{compared} compared");
}
