/// A number type of datasets, stored little-endian.
pub(crate) trait Element: Copy + Default + Send + Sync + 'static {
    const NAME: &'static str;
    const BYTES: usize;
    /// Datatype message, section IV.A.2.d: the class, then all bytes after the version.
    const DATATYPE: (u8, &'static [u8]);
    fn from_le(bytes: &[u8]) -> Self;
    fn append_le(self, bytes: &mut Vec<u8>);
    /// `false` for NaN and infinities.
    fn is_finite(self) -> bool {
        true
    }
}

macro_rules! element {
    ($number:ident, $class:literal, $datatype:expr, $($is_finite:tt)*) => {
        impl Element for $number {
            const NAME: &'static str = stringify!($number);
            const BYTES: usize = size_of::<Self>();
            const DATATYPE: (u8, &'static [u8]) = ($class, &$datatype);
            #[inline]
            fn from_le(bytes: &[u8]) -> Self {
                bytes.try_into().map(Self::from_le_bytes).unwrap_or_default()
            }
            #[inline]
            fn append_le(self, bytes: &mut Vec<u8>) {
                bytes.extend_from_slice(&self.to_le_bytes());
            }
            $($is_finite)*
        }
    };
}

element!(u8, 0, [0, 0, 0, 1, 0, 0, 0, 0, 0, 8, 0],);
element!(u16, 0, [0, 0, 0, 2, 0, 0, 0, 0, 0, 16, 0],);
element!(u32, 0, [0, 0, 0, 4, 0, 0, 0, 0, 0, 32, 0],);
element!(u64, 0, [0, 0, 0, 8, 0, 0, 0, 0, 0, 64, 0],);
element!(i64, 0, [8, 0, 0, 8, 0, 0, 0, 0, 0, 64, 0],);
element!(
    f32,
    1,
    [0x20, 0x1f, 0, 4, 0, 0, 0, 0, 0, 32, 0, 23, 8, 0, 23, 127, 0, 0, 0],
    #[inline]
    fn is_finite(self) -> bool {
        f32::is_finite(self)
    }
);
element!(
    f64,
    1,
    [0x20, 0x3f, 0, 8, 0, 0, 0, 0, 0, 64, 0, 52, 11, 0, 52, 255, 3, 0, 0],
    #[inline]
    fn is_finite(self) -> bool {
        f64::is_finite(self)
    }
);
