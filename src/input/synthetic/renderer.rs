//! The ray caster: a world and a viewpoint in, a picture and its truth out.
//!
//! Every pixel depends on the world, the viewpoint and its own coordinates
//! alone, so the result is the same for any number of threads.

use rayon::prelude::*;

use super::finish::Spot;
use super::grid::{Raster, ShadowGrid};
use super::part::Part;
use super::sensor::Sensor;
use super::shape::{Contact, Ray, Span, Vec3};
use super::viewpoint::{TILE, Viewpoint};
use super::world::World;
use crate::image::Image;

/// Depth in metres from which on a part is seen.
const NEAREST: f64 = 0.05;
/// Shadow rays start this far above the surface.
const LIFT: f64 = 2e-3;

/// What the geometry says about one view.
#[derive(Clone, Debug)]
pub struct Geometry {
    /// Depth at each pixel centre in metres, infinite in the sky.
    pub depth: Image<f64>,
    /// Object at each pixel centre, 0 for background.
    pub objects: Image<u16>,
}

/// How one picture is taken.
#[derive(Clone, Copy, Debug)]
pub struct Exposure {
    /// Samples per pixel along x and along y.
    pub samples: usize,
    /// Gain of this camera.
    pub gain: f64,
    /// Which noise.
    pub noise_seed: u32,
}

/// A world made ready for rays.
pub struct Renderer<'a> {
    world: &'a World,
    sun: Vec<ShadowGrid>,
    ambient: Vec<ShadowGrid>,
}

struct Seen<'a> {
    part: &'a Part,
    contact: Contact,
}

impl<'a> Renderer<'a> {
    /// Sorts the parts of `world` for its lights.
    pub fn new(world: &'a World) -> Self {
        let light = &world.lighting;
        let grid = |towards: &Vec3| ShadowGrid::new(&world.parts, *towards, &light.stage);
        Self {
            world,
            sun: light.sun.par_iter().map(grid).collect(),
            ambient: light.ambient.par_iter().map(|(towards, _)| grid(towards)).collect(),
        }
    }

    /// Depth and objects at the pixel centres.
    pub fn geometry(&self, view: &Viewpoint) -> Geometry {
        let tiles = view.tiles(&self.world.parts);
        let width = view.size.width;
        let mut pixels = vec![(f64::INFINITY, 0); view.size.area()];
        pixels.par_chunks_mut(width.max(1)).enumerate().for_each(|(y, row)| {
            for (x, pixel) in row.iter_mut().enumerate() {
                let list = tiles.list(x / TILE, y / TILE);
                if let Some(seen) = self.first(list, &view.ray(x as f64, y as f64)) {
                    *pixel = (seen.contact.t, seen.part.object);
                }
            }
        });
        let depth = Image::from_fn(view.size, |x, y| pixels[y * width + x].0);
        let objects = Image::from_fn(view.size, |x, y| pixels[y * width + x].1);
        Geometry { depth, objects }
    }

    /// The picture through `sensor`.
    pub fn picture(&self, view: &Viewpoint, exposure: Exposure, sensor: &Sensor) -> Image<[u8; 3]> {
        let tiles = view.tiles(&self.world.parts);
        let width = view.size.width;
        let mut image = Image::new(view.size);
        image.pixels_mut().par_chunks_mut(width.max(1)).enumerate().for_each(|(y, row)| {
            for (x, pixel) in row.iter_mut().enumerate() {
                let light = self.light(view, &tiles, (x, y), exposure.samples);
                *pixel = sensor.expose(light, exposure.gain, (exposure.noise_seed, x, y));
            }
        });
        image
    }

    /// Mean light over the samples of a pixel.
    fn light(
        &self,
        view: &Viewpoint,
        tiles: &Raster,
        (x, y): (usize, usize),
        samples: usize,
    ) -> Vec3 {
        let list = tiles.list(x / TILE, y / TILE);
        let step = 1.0 / samples as f64;
        // Neighbouring pixels ask for other points of the lights.
        let phase = samples * samples * ((x & 1) + 2 * (y & 1));
        let mut sum = Vec3::zeros();
        for j in 0..samples {
            for i in 0..samples {
                let dx = (i as f64 + 0.5) * step - 0.5;
                let dy = (j as f64 + 0.5) * step - 0.5;
                let ray = view.ray(x as f64 + dx, y as f64 + dy);
                let light = match self.first(list, &ray) {
                    Some(seen) => {
                        self.shade(&ray, &seen, step / view.focal, phase + j * samples + i)
                    }
                    None => self.world.backdrop.light(ray.direction.normalize()),
                };
                // A single sun glint must not outshine all other samples.
                sum += light.map(|v| v.min(6.0));
            }
        }
        sum * (step * step)
    }

    fn first(&self, list: &[u16], ray: &Ray) -> Option<Seen<'a>> {
        let mut span = Span { near: NEAREST, far: f64::INFINITY };
        let mut best = None;
        for index in list {
            let part = &self.world.parts[usize::from(*index)];
            if let Some(contact) = part.meet(ray, span) {
                span.far = contact.t;
                best = Some(Seen { part, contact });
            }
        }
        best
    }

    /// Light from a surface towards the camera. `sample_angle` is the size of
    /// a sample at depth 1.
    fn shade(&self, ray: &Ray, seen: &Seen, sample_angle: f64, sample: usize) -> Vec3 {
        let Seen { part, contact } = seen;
        let point = ray.at(contact.t);
        let local = part.pose.local(point);
        let towards_eye = -ray.direction.normalize();
        let mut normal = part.shape.normal(local, contact.face);
        let seen_side =
            if (part.pose.rotation * normal).dot(&towards_eye) < 0.0 { -1.0 } else { 1.0 };
        normal *= seen_side;
        let cosine = (part.pose.rotation * normal).dot(&towards_eye).max(0.03);
        let footprint = contact.t * sample_angle;
        let spot = Spot {
            local,
            normal,
            face: contact.face,
            inset: part.shape.inset(local, contact.face),
            footprint,
            blur: footprint / cosine.sqrt(),
        };
        let finish = part.material.finish(&spot);
        let flat = part.pose.rotation * normal;
        let bent = part.pose.rotation * (normal + finish.bump);
        let n = bent.normalize();
        let light = &self.world.lighting;
        let start = point + flat * LIFT;

        let index = sample % light.sun.len();
        let towards_sun = light.sun[index];
        let slope = n.dot(&towards_sun);
        let lit = slope > 0.0
            && flat.dot(&towards_sun) > 0.0
            && self.sun[index].is_lit(&self.world.parts, start);

        let mut irradiance = light.bounce * (0.62 - 0.38 * n.z);
        if lit {
            irradiance += light.sun_colour * slope;
        }
        let count = light.ambient.len();
        let mut open = 0.0;
        for k in [(2 * sample) % count, (2 * sample + 1) % count] {
            let (towards, colour) = light.ambient[k];
            let slope = n.dot(&towards);
            if flat.dot(&towards) > 0.0 && self.ambient[k].is_lit(&self.world.parts, start) {
                open += 0.5;
                irradiance += colour * (slope.max(0.0) * 0.5 * count as f64);
            }
        }
        let mut out = finish.albedo.component_mul(&irradiance) + finish.glow;
        if finish.coat > 0.0 {
            let facing = n.dot(&towards_eye).clamp(0.0, 1.0);
            let graze = 1.0 - facing;
            // Schlick's approximation of Fresnel reflection.
            let graze2 = graze * graze;
            let share = finish.coat + (1.0 - finish.coat) * graze2 * graze2 * graze * 0.6;
            let mirrored = n * (2.0 * n.dot(&towards_eye)) - towards_eye;
            let mut mirror = self.world.backdrop.light(mirrored) * (0.35 + 0.65 * open);
            if lit {
                let mut glint = mirrored.dot(&towards_sun).max(0.0);
                for _ in 0..finish.polish {
                    glint *= glint;
                }
                mirror += light.sun_colour * (glint * f64::from(finish.polish));
            }
            out = out * (1.0 - share) + mirror * share;
        }
        let depth = contact.t;
        let haze = depth / (depth + light.haze);
        let air = Vec3::new(0.62, 0.70, 0.80);
        out * (1.0 - haze) + air * haze
    }
}
