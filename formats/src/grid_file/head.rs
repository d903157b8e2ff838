//! The attributes of /sdf: what they say, how they are written, what their checksum is taken of.

use std::fmt::Write;

use sdf_core::grid::Lattice;
use sdf_core::grid::sparse::{BRICK, brick_counts};
use sha2::{Digest, Sha256};

use super::classic::{Classic, Object, Value};
use super::{About, Fault, Layout, Precision, Source, layout};

/// What docs/format.md lists for either layout, in its order, which is that of the checksum.
const COMMON: [&str; 15] = [
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
];
const OF_SPARSE: [&str; 4] = ["band", "precision", "brick_side", "bricks"];
const DIGESTS: &str = "digests_sha256";
pub(super) const CHECKSUM: &str = "attributes_sha256";

/// All that the attributes say.
#[derive(Clone, Debug)]
pub(super) struct Head {
    pub lattice: Lattice,
    pub layout: Layout,
    pub about: About,
    /// In the form of [`layout::hex`].
    pub digests_sha256: String,
}

impl Head {
    /// Reads all attributes and holds them against their checksum.
    pub(super) fn read(file: &mut Classic, sdf: &Object) -> Result<Self, Fault> {
        let [version] = Attributes::read(file, sdf, ["format_version"])?.integers("format_version")?;
        match version {
            layout::FORMAT_VERSION => {}
            1 => return Err(Fault::EarlierVersion { found: version, known: layout::FORMAT_VERSION }),
            later if later > layout::FORMAT_VERSION => {
                return Err(Fault::LaterVersion { found: later, known: layout::FORMAT_VERSION });
            }
            none => return Err(Fault::not_a_grid(format!("its format version is {none}"))),
        }
        let is_sparse = match Attributes::read(file, sdf, ["layout"])?.text("layout")? {
            "dense" => false,
            "sparse" => true,
            _ => return Err(Fault::not_a_grid("its layout is neither dense nor sparse")),
        };
        let of_sparse = OF_SPARSE.into_iter().filter(|_| is_sparse);
        let attributes = Attributes::read(file, sdf, COMMON.into_iter().chain(of_sparse).chain([DIGESTS]))?;
        if Attributes::read(file, sdf, [CHECKSUM])?.text(CHECKSUM)? != attributes.checksum() {
            return Err(Fault::damaged("checksum of the attributes does not match"));
        }
        let head = Self {
            lattice: attributes.lattice()?,
            layout: if is_sparse { attributes.sparse()? } else { Layout::Dense },
            about: attributes.about()?,
            digests_sha256: attributes.text(DIGESTS)?.to_owned(),
        };
        match head.flaw() {
            Some(flaw) => Err(Fault::damaged(flaw)),
            None => Ok(head),
        }
    }

    /// All but the last, their checksum.
    pub(super) fn attributes(&self) -> Attributes {
        let text = |text: &str| Value::Text(text.to_owned());
        let number = |number: f64| Value::Numbers(vec![number]);
        let integer = |integer: i128| Value::Integers(vec![integer]);
        let about = &self.about;
        let layout_name = if self.layout == Layout::Dense { "dense" } else { "sparse" };
        let common = [
            integer(layout::FORMAT_VERSION),
            text(layout_name),
            Value::Numbers(self.lattice.origin().to_vec()),
            number(self.lattice.spacing()),
            Value::Integers(self.lattice.nodes().map(i128::from).to_vec()),
            number(about.padding),
            text(&about.sign_method),
            text(&about.sign_verdict),
            number(about.slope_bound),
            number(about.error_bound),
            text(&about.source.name),
            text(&layout::hex(&about.source.sha256)),
            integer(about.source.triangles.into()),
            text(&about.tool),
            text(&about.options),
        ];
        let mut attributes: Vec<_> = COMMON.into_iter().zip(common).collect();
        if let Layout::Sparse { band, precision, bricks } = self.layout {
            let of_sparse = [number(band), text(precision.name()), integer(BRICK.into()), integer(bricks as i128)];
            attributes.extend(OF_SPARSE.into_iter().zip(of_sparse));
        }
        attributes.push((DIGESTS, text(&self.digests_sha256)));
        Attributes(attributes)
    }

    /// What no file may say.
    pub(super) fn flaw(&self) -> Option<String> {
        let about = &self.about;
        if !layout::SIGN_METHODS.contains(&about.sign_method.as_str()) {
            return Some(format!("sign_method is none of {:?}", layout::SIGN_METHODS));
        }
        let band = match self.layout {
            Layout::Dense => 0.0,
            Layout::Sparse { band, .. } => band,
        };
        let lengths = [
            ("slope_bound", about.slope_bound),
            ("error_bound", about.error_bound),
            ("padding", about.padding),
            ("band", band),
        ];
        if let Some((name, bad)) = lengths.into_iter().find(|(_, length)| !(length.is_finite() && *length >= 0.0)) {
            return Some(format!("{name} is {bad}"));
        }
        if let Layout::Sparse { bricks, .. } = self.layout {
            let places = brick_counts(&self.lattice).iter().map(|along| u128::from(*along)).product::<u128>();
            if bricks == 0 || bricks as u128 > places.min(layout::MAX_BRICKS as u128) {
                return Some(format!("{bricks} bricks for {places} places"));
            }
        }
        let texts = [&about.sign_verdict, &about.source.name, &about.tool, &about.options];
        let bad = texts.into_iter().find(|text| text.len() > layout::MAX_TEXT || text.contains('\0'));
        bad.map(|text| format!("a text of {} bytes is longer than 65536 or holds a NUL", text.len()))
    }
}

/// Attributes by name.
pub(super) struct Attributes(pub Vec<(&'static str, Value)>);

impl Attributes {
    pub(super) fn read(
        file: &mut Classic,
        object: &Object,
        names: impl IntoIterator<Item = &'static str>,
    ) -> Result<Self, Fault> {
        names.into_iter().map(|name| Ok((name, file.attribute(object, name)?))).collect::<Result<_, _>>().map(Self)
    }

    /// SHA-256 over their text, one line each, as docs/format.md gives it.
    pub(super) fn checksum(&self) -> String {
        let mut text = String::new();
        for (name, value) in &self.0 {
            let value = match value {
                Value::Text(text) => text.clone(),
                Value::Integers(integers) => joined(integers, |integer| integer.to_string()),
                Value::Numbers(numbers) => joined(numbers, |number| format!("{:016x}", number.to_bits())),
            };
            writeln!(text, "{name}={value}").expect("a String takes everything");
        }
        layout::hex(&Sha256::digest(text))
    }

    fn lattice(&self) -> Result<Lattice, Fault> {
        let origin = self.numbers("origin")?;
        let [spacing] = self.numbers("spacing")?;
        let counts = self.integers::<3>("counts")?;
        let nodes = counts.map(|n| u32::try_from(n).unwrap_or(0));
        Lattice::new(origin, spacing, nodes)
            .ok_or_else(|| Fault::damaged(format!("{counts:?} nodes {spacing} apart from {origin:?} are no grid")))
    }

    fn sparse(&self) -> Result<Layout, Fault> {
        let [band] = self.numbers("band")?;
        let [bricks] = self.integers("bricks")?;
        let precision = Precision::named(self.text("precision")?);
        if self.integers("brick_side")? != [i128::from(BRICK)] {
            return Err(Fault::not_a_grid(format!("its bricks do not have {BRICK} nodes along a side")));
        }
        Ok(Layout::Sparse {
            band,
            precision: precision.ok_or_else(|| Fault::not_a_grid("its precision is none of f32, u16 and u8"))?,
            bricks: usize::try_from(bricks).map_err(|_| Fault::damaged("bricks is no count"))?,
        })
    }

    fn about(&self) -> Result<About, Fault> {
        let [slope_bound] = self.numbers("slope_bound")?;
        let [error_bound] = self.numbers("error_bound")?;
        let [padding] = self.numbers("padding")?;
        Ok(About {
            sign_method: self.text("sign_method")?.to_owned(),
            sign_verdict: self.text("sign_verdict")?.to_owned(),
            slope_bound,
            error_bound,
            padding,
            source: self.source()?,
            tool: self.text("tool")?.to_owned(),
            options: self.text("options")?.to_owned(),
        })
    }

    fn source(&self) -> Result<Source, Fault> {
        let sha256 = layout::sha256_from_hex(self.text("source_sha256")?);
        let [triangles] = self.integers("source_triangles")?;
        Ok(Source {
            name: self.text("source_name")?.to_owned(),
            sha256: sha256.ok_or_else(|| Fault::damaged("source_sha256 is not 64 hexadecimal digits"))?,
            triangles: triangles.try_into().map_err(|_| Fault::damaged("source_triangles is no count"))?,
        })
    }

    fn value(&self, name: &str) -> Result<&Value, Fault> {
        let found = self.0.iter().find(|(known, _)| *known == name);
        found.map(|(_, value)| value).ok_or_else(|| unexpected(name))
    }

    pub(super) fn integers<const N: usize>(&self, name: &str) -> Result<[i128; N], Fault> {
        match self.value(name)? {
            Value::Integers(integers) => integers.as_slice().try_into().map_err(|_| unexpected(name)),
            _ => Err(unexpected(name)),
        }
    }

    pub(super) fn numbers<const N: usize>(&self, name: &str) -> Result<[f64; N], Fault> {
        match self.value(name)? {
            Value::Numbers(numbers) => numbers.as_slice().try_into().map_err(|_| unexpected(name)),
            _ => Err(unexpected(name)),
        }
    }

    pub(super) fn text(&self, name: &str) -> Result<&str, Fault> {
        match self.value(name)? {
            Value::Text(text) => Ok(text),
            _ => Err(unexpected(name)),
        }
    }
}

fn joined<T>(values: &[T], written: impl Fn(&T) -> String) -> String {
    values.iter().map(written).collect::<Vec<_>>().join(" ")
}

fn unexpected(name: &str) -> Fault {
    Fault::not_a_grid(format!("its attribute {name} is not what docs/format.md says"))
}
