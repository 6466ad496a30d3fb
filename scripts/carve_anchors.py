"""What other carvers and cuts do on the sequences of the carving benchmark, for scripts/carve_compare.

Measured for this project on the same inputs and the same kind of machine (2 shared vCPU, one core
used). "reference": the carver and cut of the paper's own group, compiled unmodified, remembering K
constraints per cell. "prototype": a plain lossless carver on CGAL, without votes. "soft": cuts of
the soft-visibility family (Labatut, Pons, Keriven 2009; Jancosek, Pajdla 2011) on the same rays.
"""

POINTS = {"s1k": 1_000, "s3k": 3_000, "s10k": 10_000, "s30k": 30_000, "s100k": 100_000}

# ms per keyframe: mean, 95 % quantile
CARVING_MS = {
    "reference, K = ∞ (lossless)": {"s1k": (35, 108), "s3k": (124, 474), "s10k": (524, 1695)},
    "reference, K = 1 (loses cells)": {"s1k": (9, 23), "s3k": (16, 34), "s10k": (35, 73),
                                       "s30k": (65, 113), "s100k": (124, 220)},
    "plain lossless prototype": {"s1k": (1.8, 5.2), "s3k": (5.3, 20), "s10k": (16.3, 49),
                                 "s30k": (29, 94), "s100k": (54, 128)},
}

# ms for cut and surface, always from scratch (λ = 0.05). s100k was ended after 300 s.
REFERENCE_CUT_MS = {"s1k": 51, "s3k": 220, "s10k": 1_433, "s30k": 13_597}
REFERENCE_CUT_AT_LEAST_MS = {"s100k": 300_000}

# mean error of the mesh in cm; shares in %: within 5 cm of the truth; of the seen surface within
# 5 cm of the mesh; of the pixels of 64 unseen views with depth within 5 %
ACCURACY = {
    "reference": {"s1k": (18.5, 40, 57, 57), "s3k": (12.4, 64, 71, 81),
                  "s10k": (54.6, 36, 77, 72)},
    "soft visibility, area term": {"s3k": (3.2, 84, 73, 85), "s10k": (4.2, 87, 89, 90),
                                   "s30k": (6.3, 85, 94, 92), "s100k": (1.7, 95, 98, 97)},
    "soft visibility, quality term": {"s1k": (28.5, 41, 69, 68), "s3k": (9.4, 63, 85, 88),
                                      "s10k": (6.6, 81, 93, 93)},
}
