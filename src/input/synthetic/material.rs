//! The looks a part can have.

use super::finish::{Finish, Spot, rgb};
use super::shape::Vec3;
use super::texture::car::{self, CarLook};
use super::texture::front::Front;
use super::texture::outdoor::{self, Sign, Weave};
use super::texture::{indoor, road};

/// What a part is made of.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs, reason = "the fields are the parameters of the texture functions")]
pub enum Material {
    /// Carriageway.
    Asphalt,
    /// Kerb stones.
    Kerb,
    /// Pavement.
    Slabs,
    /// Grass.
    Lawn,
    /// House front.
    Front(Front),
    /// Lower body of a car.
    CarBody(CarLook),
    /// Cabin of a car.
    CarCabin(CarLook),
    /// Wheel of a car, turned by an angle.
    Wheel { radius: f64, turn: f64 },
    /// Clothes.
    Cloth { colour: Vec3, second: Vec3, weave: Weave, seed: u32 },
    /// An awning, striped along x.
    Awning { colour: Vec3, second: Vec3 },
    /// Skin, with or without a face.
    Skin { colour: Vec3, face: bool },
    /// Hair.
    Hair(Vec3),
    /// Bark.
    Bark(u32),
    /// Leaves.
    Leaves { seed: u32, autumn: f64, leaf: f64 },
    /// Painted metal.
    Metal { colour: Vec3, seed: u32 },
    /// A post with two reflecting bands.
    Banded { colour: Vec3, band: Vec3 },
    /// Traffic sign.
    Sign { kind: Sign, half: f64 },
    /// A lamp that shines.
    Lamp,
    /// Table top.
    Boards,
    /// Wall of a room.
    Wallpaper,
    /// Framed picture.
    Picture { seed: u32, half: (f64, f64) },
    /// Printed carton.
    Carton { seed: u32, base: Vec3, accent: Vec3, size: (f64, f64, f64) },
    /// Mug.
    Mug { colour: Vec3, band: Vec3, radius: f64, height: f64 },
    /// Bottle.
    Bottle { glass: Vec3, label: Vec3, seed: u32, radius: f64, height: f64 },
    /// Ball of coloured segments.
    Ball { colours: [Vec3; 3], radius: f64 },
    /// Book.
    Book { cover: Vec3, ink: Vec3, seed: u32, size: (f64, f64, f64) },
    /// Printed sheet.
    Sheet { seed: u32, size: (f64, f64) },
    /// Woven place mat.
    Mat { colour: Vec3, second: Vec3, half: (f64, f64) },
    /// One colour with specks.
    Plain { colour: Vec3, seed: u32 },
}

impl Material {
    /// The look at a spot.
    pub fn finish(&self, spot: &Spot) -> Finish {
        match *self {
            Self::Asphalt => road::asphalt(spot),
            Self::Kerb => road::kerb(spot),
            Self::Slabs => road::slabs(spot),
            Self::Lawn => road::lawn(spot),
            Self::Front(ref front) => front.finish(spot),
            Self::CarBody(ref look) => car::body(look, spot),
            Self::CarCabin(ref look) => car::cabin(look, spot),
            Self::Wheel { radius, turn } => car::wheel(radius, turn, spot),
            Self::Cloth { colour, second, weave, seed } => {
                outdoor::cloth(colour, second, weave, seed, spot)
            }
            Self::Awning { colour, second } => outdoor::awning(colour, second, spot),
            Self::Skin { colour, face } => outdoor::skin(colour, face, spot),
            Self::Hair(colour) => outdoor::hair(colour, spot),
            Self::Bark(seed) => outdoor::bark(seed, spot),
            Self::Leaves { seed, autumn, leaf } => outdoor::leaves(seed, autumn, leaf, spot),
            Self::Metal { colour, seed } => outdoor::metal(colour, seed, spot),
            Self::Banded { colour, band } => outdoor::banded(colour, band, spot),
            Self::Sign { kind, half } => outdoor::sign(kind, half, spot),
            Self::Lamp => Finish { glow: rgb(0xFF_F4_D8), ..Finish::matt(rgb(0xE0_E0_E0)) },
            Self::Boards => indoor::boards(spot),
            Self::Wallpaper => indoor::wallpaper(spot),
            Self::Picture { seed, half } => indoor::picture(seed, half, spot),
            Self::Carton { seed, base, accent, size } => {
                indoor::box_print(seed, base, accent, size, spot)
            }
            Self::Mug { colour, band, radius, height } => {
                indoor::mug(colour, band, radius, height, spot)
            }
            Self::Bottle { glass, label, seed, radius, height } => {
                indoor::bottle(glass, label, seed, radius, height, spot)
            }
            Self::Ball { colours, radius } => indoor::ball(colours, radius, spot),
            Self::Book { cover, ink, seed, size } => indoor::book(cover, ink, seed, size, spot),
            Self::Sheet { seed, size } => indoor::sheet(seed, size, spot),
            Self::Mat { colour, second, half } => indoor::mat(colour, second, half, spot),
            Self::Plain { colour, seed } => indoor::plain(colour, seed, spot),
        }
    }
}
