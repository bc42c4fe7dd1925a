/* One line a BSDF: its const struct bsdf_ops is bsdf_ops_NAME. */
BSDF(diffuse)
BSDF(conductor)
BSDF(roughconductor)
BSDF(dielectric)
BSDF(roughdielectric)
BSDF(phong)
BSDF(twosided)
