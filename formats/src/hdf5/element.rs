/// A number type of datasets, stored little-endian.
pub(crate) trait Element: Copy + Default + Send + Sync + 'static {
    const NAME: &'static str;
    const BYTES: usize;
    /// Datatype message, section IV.A.2.d: the class, then all bytes after the version.
    const DATATYPE: (u8, &'static [u8]);
    /// Sets as many elements as both hold.
    fn copy_from_le(elements: &mut [Self], bytes: &[u8]);
    /// Sets the bytes of as many elements as both hold.
    fn copy_to_le(elements: &[Self], bytes: &mut [u8]);
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
            fn copy_from_le(elements: &mut [Self], bytes: &[u8]) {
                let (bytes, _) = bytes.as_chunks();
                elements.iter_mut().zip(bytes).for_each(|(element, bytes)| *element = Self::from_le_bytes(*bytes));
            }
            #[inline]
            fn copy_to_le(elements: &[Self], bytes: &mut [u8]) {
                let (bytes, _) = bytes.as_chunks_mut();
                elements.iter().zip(bytes).for_each(|(element, bytes)| *bytes = element.to_le_bytes());
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
