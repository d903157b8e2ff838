use std::path::Path;

use sdf_core::grid::Lattice;

use super::classic::{Classic, Dataset, Object, Value};
use super::{About, Fault, GridFile, GridFileError, Source, Summary, layout};

/// Reads a grid and holds it against its checksums.
///
/// What is cut short, damaged, not HDF5, not a grid, of a later version, or declares more than it holds is refused.
/// Memory stays within 1032 times the size of the file, the most that deflate packs.
pub fn read(path: &Path) -> Result<GridFile, GridFileError> {
    Opened::open(path).and_then(Opened::grid).map_err(|fault| fault.at(path))
}

/// Reads all but the samples, which may be damaged without its being noticed here.
pub fn read_summary(path: &Path) -> Result<Summary, GridFileError> {
    Opened::open(path).map(Opened::summary).map_err(|fault| fault.at(path))
}

/// A file of which all but the samples is read and checked.
struct Opened {
    file: Classic,
    dataset: Dataset,
    lattice: Lattice,
    about: About,
    samples_sha256: String,
}

impl Opened {
    fn open(path: &Path) -> Result<Self, Fault> {
        let mut file = Classic::open(path)?;
        let sdf = file.member(None, "sdf")?;
        let mut attributes = Attributes { file: &mut file, object: &sdf };
        let [version] = attributes.integers("format_version")?;
        if version > layout::FORMAT_VERSION {
            return Err(Fault::LaterVersion { found: version, known: layout::FORMAT_VERSION });
        }
        if version != layout::FORMAT_VERSION {
            return Err(Fault::not_a_grid(format!("its format version is {version}")));
        }
        if attributes.text("layout")? != "dense" {
            return Err(Fault::not_a_grid("its layout is not dense"));
        }
        let lattice = attributes.lattice()?;
        let about = attributes.about()?;
        let samples_sha256 = attributes.text("samples_sha256")?;
        if attributes.text("attributes_sha256")? != layout::attributes_sha256(&lattice, &about, &samples_sha256) {
            return Err(Fault::damaged("checksum of the attributes does not match"));
        }
        if let Some(flaw) = about.flaw() {
            return Err(Fault::damaged(flaw));
        }
        let dataset = vtkhdf(&mut file, &lattice)?;
        Ok(Self { file, dataset, lattice, about, samples_sha256 })
    }

    fn grid(mut self) -> Result<GridFile, Fault> {
        let distances = self.file.samples(&self.dataset)?;
        if layout::samples_sha256(&distances) != self.samples_sha256 {
            return Err(Fault::damaged("checksum of the samples does not match"));
        }
        if distances.iter().any(|distance| !distance.is_finite()) {
            return Err(Fault::damaged("a sample is not finite"));
        }
        Ok(GridFile { lattice: self.lattice, distances, about: self.about })
    }

    fn summary(self) -> Summary {
        Summary { lattice: self.lattice, about: self.about, file_bytes: self.file.file_bytes() }
    }
}

/// The samples, once all that VTK is told about them agrees with /sdf.
fn vtkhdf(file: &mut Classic, lattice: &Lattice) -> Result<Dataset, Fault> {
    let group = file.member(None, "VTKHDF")?;
    let mut attributes = Attributes { file: &mut *file, object: &group };
    let spacing = [lattice.spacing(); 3];
    let agree = attributes.integers("Version")? == layout::VTKHDF_VERSION.map(i128::from)
        && attributes.text("Type")? == "ImageData"
        && attributes.integers("WholeExtent")? == layout::whole_extent(lattice).map(i128::from)
        && attributes.numbers("Origin")?.map(f64::to_bits) == lattice.origin().map(f64::to_bits)
        && attributes.numbers("Spacing")? == spacing
        && attributes.numbers("Direction")? == layout::IDENTITY;
    let points = file.member(Some(&group), "PointData")?;
    let scalars = Attributes { file: &mut *file, object: &points }.text("Scalars")?;
    let object = file.member(Some(&points), "distance")?;
    let role = Attributes { file: &mut *file, object: &object }.text("Attribute")?;
    let dataset = file.dataset(&object)?;
    if !agree || scalars != "distance" || role != "Scalars" || dataset.shape() != layout::shape(lattice) {
        return Err(Fault::damaged("/VTKHDF and /sdf do not agree"));
    }
    Ok(dataset)
}

struct Attributes<'a> {
    file: &'a mut Classic,
    object: &'a Object,
}

impl Attributes<'_> {
    fn lattice(&mut self) -> Result<Lattice, Fault> {
        let origin = self.numbers("origin")?;
        let [spacing] = self.numbers("spacing")?;
        let counts = self.integers::<3>("counts")?;
        let nodes = counts.map(|n| u32::try_from(n).unwrap_or(0));
        Lattice::new(origin, spacing, nodes)
            .ok_or_else(|| Fault::damaged(format!("{counts:?} nodes {spacing} apart from {origin:?} are no grid")))
    }

    fn about(&mut self) -> Result<About, Fault> {
        let [slope_bound] = self.numbers("slope_bound")?;
        let [error_bound] = self.numbers("error_bound")?;
        Ok(About {
            sign_method: self.text("sign_method")?,
            sign_verdict: self.text("sign_verdict")?,
            slope_bound,
            error_bound,
            source: self.source()?,
            tool: self.text("tool")?,
            options: self.text("options")?,
        })
    }

    fn source(&mut self) -> Result<Source, Fault> {
        let sha256 = layout::sha256_from_hex(&self.text("source_sha256")?);
        let [triangles] = self.integers("source_triangles")?;
        Ok(Source {
            name: self.text("source_name")?,
            sha256: sha256.ok_or_else(|| Fault::damaged("source_sha256 is not 64 hexadecimal digits"))?,
            triangles: triangles.try_into().map_err(|_| Fault::damaged("source_triangles is no count"))?,
        })
    }

    fn integers<const N: usize>(&mut self, name: &str) -> Result<[i128; N], Fault> {
        match self.file.attribute(self.object, name)? {
            Value::Integers(integers) => integers.try_into().map_err(|_| unexpected(name)),
            _ => Err(unexpected(name)),
        }
    }

    fn numbers<const N: usize>(&mut self, name: &str) -> Result<[f64; N], Fault> {
        match self.file.attribute(self.object, name)? {
            Value::Numbers(numbers) => numbers.try_into().map_err(|_| unexpected(name)),
            _ => Err(unexpected(name)),
        }
    }

    fn text(&mut self, name: &str) -> Result<String, Fault> {
        match self.file.attribute(self.object, name)? {
            Value::Text(text) => Ok(text),
            _ => Err(unexpected(name)),
        }
    }
}

fn unexpected(name: &str) -> Fault {
    Fault::not_a_grid(format!("its attribute {name} is not what docs/format.md says"))
}
