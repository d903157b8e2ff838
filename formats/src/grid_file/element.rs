use rust_hdf5::H5Type;

/// A number as datasets hold it, little-endian.
pub(super) trait Element: H5Type + Copy + Default + Send + Sync {
    const NAME: &'static str;
    const BYTES: usize;
    /// How HDF5 describes it, section IV.A.2.d: class, then all that follows the version.
    const DATATYPE: (u8, &'static [u8]);
    fn from_le(bytes: &[u8]) -> Self;
    fn put_le(self, bytes: &mut Vec<u8>);
    fn is_valid(self) -> bool {
        true
    }
}

macro_rules! element {
    ($number:ident, $class:literal, $datatype:expr, $($is_valid:tt)*) => {
        impl Element for $number {
            const NAME: &'static str = stringify!($number);
            const BYTES: usize = size_of::<Self>();
            const DATATYPE: (u8, &'static [u8]) = ($class, &$datatype);
            #[inline]
            fn from_le(bytes: &[u8]) -> Self {
                bytes.try_into().map(Self::from_le_bytes).unwrap_or_default()
            }
            #[inline]
            fn put_le(self, bytes: &mut Vec<u8>) {
                bytes.extend_from_slice(&self.to_le_bytes());
            }
            $($is_valid)*
        }
    };
}

element!(u8, 0, [0, 0, 0, 1, 0, 0, 0, 0, 0, 8, 0],);
element!(u16, 0, [0, 0, 0, 2, 0, 0, 0, 0, 0, 16, 0],);
element!(u32, 0, [0, 0, 0, 4, 0, 0, 0, 0, 0, 32, 0],);
element!(
    f32,
    1,
    [0x20, 0x1f, 0, 4, 0, 0, 0, 0, 0, 32, 0, 23, 8, 0, 23, 127, 0, 0, 0],
    #[inline]
    fn is_valid(self) -> bool {
        self.is_finite()
    }
);
