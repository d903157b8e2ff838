//! Attributes of /sdf: their meaning and their HDF5 types.
//!
//! docs/format.md lists the attributes; their order here is that of the checksum.

use sdf_core::grid::Lattice;
use sdf_core::grid::owned::Precision;
use sdf_core::grid::sparse::{BRICK, brick_counts};

use super::attributes::Attributes;
use super::coding::Coding;
use super::{About, DeepValues, GridFault, MeshInfo, SignMethod, Source, SparseInfo, error_regions, layout, layout_of};
use crate::hdf5::{Hdf5Reader, MAX_TEXT_BYTES, Object, Value};

/// Attributes of both layouts.
const COMMON: [&str; 17] = [
    "format_version",
    "layout",
    "origin",
    "spacing",
    "counts",
    "padding",
    "sign_method",
    "sign_verdict",
    "slope_bound",
    "error_bound",
    "source_name",
    "source_sha256",
    "source_triangles",
    "tool",
    "options",
    KEPT_MESH,
    MESH_COUNTS,
];
/// Attributes of sparse grids, after the common ones.
const SPARSE_ONLY: [&str; 6] = ["band", "precision", "brick_side", "bricks", DEEP_VALUES, CODING];
/// Attributes of dense grids from version 5 on, after the common ones: their samples are codes.
const DENSE_CODES_ONLY: [&str; 3] = ["precision", "brick_side", CODING];
/// Attributes that earlier versions do not have, and the first that has them.
const NEW: [(&str, i128); 4] = [(KEPT_MESH, 3), (MESH_COUNTS, 3), (DEEP_VALUES, 3), (CODING, 4)];
const KEPT_MESH: &str = "kept_mesh";
const MESH_COUNTS: &str = "mesh_counts";
const DEEP_VALUES: &str = "deep_values";
const CODING: &str = "coding";
/// Attribute of grids that are inside at the faces of their box alone.
const INSIDE_REACHES_BOX: &str = "inside_reaches_box";
const DIGESTS: &str = "digests_sha256";
pub(super) const CHECKSUM: &str = "attributes_sha256";

/// The values of all attributes.
#[derive(Clone, Debug)]
pub(super) struct Header {
    /// Version of the format: of what is written, the first that has all of it.
    pub version: i128,
    pub lattice: Lattice,
    pub sparse: Option<SparseInfo>,
    /// The type of a sample.
    pub precision: Precision,
    /// Coding of samples that are codes.
    pub coding: Coding,
    pub about: About,
    /// `None` where the file keeps no mesh.
    pub mesh: Option<MeshInfo>,
    /// SHA-256 of the dataset `digests`, in the form of [`layout::hex`].
    pub digests_sha256: String,
}

impl Header {
    /// Reads all attributes and verifies their checksum.
    pub(super) fn read(file: &Hdf5Reader, sdf: &Object) -> Result<Self, GridFault> {
        let version = Self::read_version(file, sdf)?;
        let is_sparse = match Attributes::read(file, sdf, ["layout"])?.text("layout")? {
            "dense" => false,
            "sparse" => true,
            _ => return Err(GridFault::not_a_grid("its layout is neither dense nor sparse")),
        };
        let is_known = |name: &&str| NEW.iter().all(|(new, first)| new != name || version >= *first);
        let of_layout: &[&str] = match is_sparse {
            true => &SPARSE_ONLY,
            false if version >= layout::DENSE_CODES_VERSION => &DENSE_CODES_ONLY,
            false => &[],
        };
        let reaches_box = file.has_attribute(sdf, INSIDE_REACHES_BOX)?.then_some(INSIDE_REACHES_BOX);
        let names =
            COMMON.into_iter().chain(of_layout.iter().copied()).chain(reaches_box).chain([DIGESTS]).filter(is_known);
        let attributes = Attributes::read(file, sdf, names)?;
        if Attributes::read(file, sdf, [CHECKSUM])?.text(CHECKSUM)? != attributes.checksum() {
            return Err(GridFault::damaged("checksum of the attributes does not match"));
        }
        let mut header = Self::from_attributes(version, is_sparse, &attributes)?;
        header.about.error_regions = error_regions::read(file, sdf)?;
        match header.violation().or_else(|| header.brick_violation()) {
            Some(violation) => Err(GridFault::damaged(violation)),
            None => Ok(header),
        }
    }

    /// Reads the header of a part of a sparse grid and the attributes that only parts have, and verifies their checksum. The number of
    /// bricks is the part's own, the bounds and slopes are zero.
    pub(super) fn read_part(
        file: &Hdf5Reader,
        part: &Object,
        part_only: impl IntoIterator<Item = &'static str>,
    ) -> Result<(Self, Attributes), GridFault> {
        let version = Self::read_version(file, part)?;
        let names = COMMON.into_iter().chain(SPARSE_ONLY).chain([DIGESTS]).chain(part_only);
        let attributes = Attributes::read(file, part, names)?;
        if Attributes::read(file, part, [CHECKSUM])?.text(CHECKSUM)? != attributes.checksum() {
            return Err(GridFault::damaged("checksum of the attributes does not match"));
        }
        let header = Self::from_attributes(version, true, &attributes)?;
        match header.violation() {
            Some(violation) => Err(GridFault::damaged(violation)),
            None => Ok((header, attributes)),
        }
    }

    fn read_version(file: &Hdf5Reader, sdf: &Object) -> Result<i128, GridFault> {
        let [version] = Attributes::read(file, sdf, ["format_version"])?.integers("format_version")?;
        match version {
            layout::OLDEST_VERSION..=layout::FORMAT_VERSION => {}
            1 => return Err(GridFault::EarlierVersion { found: version, known: layout::OLDEST_VERSION }),
            later if later > layout::FORMAT_VERSION => {
                return Err(GridFault::LaterVersion { found: later, known: layout::FORMAT_VERSION });
            }
            unknown => return Err(GridFault::not_a_grid(format!("its format version is {unknown}"))),
        }
        Ok(version)
    }

    fn from_attributes(version: i128, is_sparse: bool, attributes: &Attributes) -> Result<Self, GridFault> {
        let sparse = if is_sparse { Some(attributes.sparse()?) } else { None };
        let precision = match sparse {
            Some(sparse) => sparse.precision,
            None if version >= layout::DENSE_CODES_VERSION => attributes.dense_codes()?,
            None => Precision::F32,
        };
        Ok(Self {
            version,
            lattice: attributes.lattice()?,
            sparse,
            precision,
            coding: attributes.coding()?,
            about: attributes.about()?,
            mesh: attributes.mesh()?,
            digests_sha256: attributes.text(DIGESTS)?.to_owned(),
        })
    }

    /// All attributes but their checksum, which comes last.
    pub(super) fn attributes(&self) -> Attributes {
        let text = |text: &str| Value::Text(text.to_owned());
        let number = |number: f64| Value::Numbers(vec![number]);
        let integer = |integer: i128| Value::Integers(vec![integer]);
        let about = &self.about;
        let layout = layout_of(self.sparse);
        let common = [
            integer(self.version),
            text(layout.name()),
            Value::Numbers(self.lattice.origin().to_vec()),
            number(self.lattice.spacing()),
            Value::Integers(self.lattice.nodes().map(i128::from).to_vec()),
            number(about.padding),
            text(about.sign_method.name()),
            text(&about.sign_reason),
            number(about.slope_bound),
            number(about.error_bound),
            text(&about.source.name),
            text(&layout::hex(&about.source.sha256)),
            integer(about.source.triangles.into()),
            text(&about.tool),
            text(&about.options),
            text(MeshInfo::kind(self.mesh)),
            Value::Integers(self.mesh.map_or([0; 2], |mesh| [mesh.vertices as i128, mesh.triangles as i128]).to_vec()),
        ];
        let mut attributes: Vec<_> = COMMON.into_iter().zip(common).collect();
        if let Some(SparseInfo { band, precision, bricks, deep_values }) = self.sparse {
            let sparse_only = [
                number(band),
                text(precision.name()),
                integer(BRICK.into()),
                integer(bricks as i128),
                text(deep_values.name()),
                text(self.coding.name()),
            ];
            attributes.extend(SPARSE_ONLY.into_iter().zip(sparse_only));
        } else if self.precision != Precision::F32 {
            let codes_only = [text(self.precision.name()), integer(BRICK.into()), text(self.coding.name())];
            attributes.extend(DENSE_CODES_ONLY.into_iter().zip(codes_only));
        }
        if about.inside_reaches_box {
            attributes.push((INSIDE_REACHES_BOX, integer(1)));
        }
        attributes.push((DIGESTS, text(&self.digests_sha256)));
        Attributes(attributes)
    }

    /// The first value that no file may have, in words.
    pub(super) fn violation(&self) -> Option<String> {
        let about = &self.about;
        let band = self.sparse.map_or(0.0, |sparse| sparse.band);
        let lengths = [("slope_bound", about.slope_bound), ("padding", about.padding), ("band", band)];
        if let Some((name, bad)) = lengths.into_iter().find(|(_, length)| !(length.is_finite() && *length >= 0.0)) {
            return Some(format!("{name} is {bad}"));
        }
        // Infinite where nothing is certified.
        if about.error_bound.is_nan() || about.error_bound < 0.0 {
            return Some(format!("error_bound is {}", about.error_bound));
        }
        if about.error_regions.as_ref().is_some_and(|found| !error_regions::is_valid(found)) {
            return Some("error_regions are not regions".to_owned());
        }
        let texts = [&about.sign_reason, &about.source.name, &about.tool, &about.options];
        let bad = texts.into_iter().find(|text| text.len() > MAX_TEXT_BYTES || text.contains('\0'));
        bad.map(|text| format!("a text of {} bytes is longer than 65536 or contains a NUL", text.len()))
    }
}

impl Header {
    /// A number of bricks that no grid has, in words.
    pub(super) fn brick_violation(&self) -> Option<String> {
        let SparseInfo { bricks, .. } = self.sparse?;
        let slots = brick_counts(&self.lattice).iter().map(|slots| u128::from(*slots)).product::<u128>();
        let is_bad = bricks == 0 || bricks as u128 > slots.min(layout::MAX_BRICKS as u128);
        is_bad.then(|| format!("{bricks} bricks for {slots} brick slots"))
    }
}

impl Attributes {
    fn lattice(&self) -> Result<Lattice, GridFault> {
        let origin = self.numbers("origin")?;
        let [spacing] = self.numbers("spacing")?;
        let counts = self.integers::<3>("counts")?;
        let nodes = counts.map(|n| u32::try_from(n).unwrap_or(0));
        Lattice::new(origin, spacing, nodes).ok_or_else(|| {
            GridFault::damaged(format!("{counts:?} nodes {spacing} apart from {origin:?} are not a grid"))
        })
    }

    fn sparse(&self) -> Result<SparseInfo, GridFault> {
        let [band] = self.numbers("band")?;
        let [bricks] = self.integers("bricks")?;
        Ok(SparseInfo {
            band,
            precision: self.precision()?,
            bricks: usize::try_from(bricks).map_err(|_| GridFault::damaged("bricks is not a count"))?,
            deep_values: self.deep_values()?,
        })
    }

    /// The precision of bricks, or of blocks of a dense grid.
    fn precision(&self) -> Result<Precision, GridFault> {
        let precision = Precision::from_name(self.text("precision")?);
        if self.integers("brick_side")? != [i128::from(BRICK)] {
            return Err(GridFault::not_a_grid(format!("its bricks do not have {BRICK} nodes along a side")));
        }
        precision.ok_or_else(|| GridFault::not_a_grid("its precision is not f32, u16 or u8"))
    }

    /// The precision of a dense grid whose samples are codes. One of f32 has another structure, and an earlier version.
    fn dense_codes(&self) -> Result<Precision, GridFault> {
        match self.precision()? {
            Precision::F32 => {
                Err(GridFault::not_a_grid("its precision is f32, which dense grids of its version do not have"))
            }
            precision => Ok(precision),
        }
    }

    /// Files of version 2 do not say.
    fn deep_values(&self) -> Result<DeepValues, GridFault> {
        if self.value(DEEP_VALUES).is_err() {
            return Ok(DeepValues::LowerBounds);
        }
        let name = self.text(DEEP_VALUES)?;
        let unknown = || format!("{DEEP_VALUES} is {name:?}, not one of {:?}", DeepValues::ALL.map(DeepValues::name));
        DeepValues::from_name(name).ok_or_else(|| GridFault::damaged(unknown()))
    }

    /// Earlier versions than 4 know one coding alone, dense grids of f32 none.
    fn coding(&self) -> Result<Coding, GridFault> {
        if self.value(CODING).is_err() {
            return Ok(Coding::Differences);
        }
        let name = self.text(CODING)?;
        let unknown = || format!("{CODING} is {name:?}, not one of {:?}", Coding::ALL.map(Coding::name));
        Coding::ALL.into_iter().find(|coding| coding.name() == name).ok_or_else(|| GridFault::damaged(unknown()))
    }

    /// Files of version 2 keep none.
    fn mesh(&self) -> Result<Option<MeshInfo>, GridFault> {
        if self.value(KEPT_MESH).is_err() {
            return Ok(None);
        }
        let kind = self.text(KEPT_MESH)?;
        let counts: [i128; 2] = self.integers(MESH_COUNTS)?;
        let known = MeshInfo::KINDS.into_iter().find(|(_, name)| *name == kind);
        match (known, counts.map(usize::try_from)) {
            (Some((is_sign_continuous, _)), [Ok(vertices), Ok(triangles)]) if vertices > 0 && triangles > 0 => {
                Ok(Some(MeshInfo { vertices, triangles, is_sign_continuous }))
            }
            (None, [Ok(0), Ok(0)]) if kind == "none" => Ok(None),
            _ => Err(GridFault::damaged(format!("{KEPT_MESH} is {kind:?} with {MESH_COUNTS} {counts:?}"))),
        }
    }

    fn about(&self) -> Result<About, GridFault> {
        let [slope_bound] = self.numbers("slope_bound")?;
        let [error_bound] = self.numbers("error_bound")?;
        let [padding] = self.numbers("padding")?;
        Ok(About {
            sign_method: self.sign_method()?,
            sign_reason: self.text("sign_verdict")?.to_owned(),
            slope_bound,
            error_bound,
            inside_reaches_box: self.value(INSIDE_REACHES_BOX).is_ok(),
            error_regions: None,
            padding,
            source: self.source()?,
            tool: self.text("tool")?.to_owned(),
            options: self.text("options")?.to_owned(),
        })
    }

    fn sign_method(&self) -> Result<SignMethod, GridFault> {
        let name = self.text("sign_method")?;
        let unknown = || format!("sign_method is {name:?}, not one of {:?}", SignMethod::ALL.map(SignMethod::name));
        SignMethod::from_name(name).ok_or_else(|| GridFault::damaged(unknown()))
    }

    fn source(&self) -> Result<Source, GridFault> {
        let sha256 = layout::sha256_from_hex(self.text("source_sha256")?);
        let [triangles] = self.integers("source_triangles")?;
        Ok(Source {
            name: self.text("source_name")?.to_owned(),
            sha256: sha256.ok_or_else(|| GridFault::damaged("source_sha256 is not 64 hexadecimal digits"))?,
            triangles: triangles.try_into().map_err(|_| GridFault::damaged("source_triangles is not a count"))?,
        })
    }
}
