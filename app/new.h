/* new.h - texts that `cleave new` writes. */
#pragma once
extern const char AppNewUcs[], AppNewTriaxial[], AppNewHydrostatic[], AppNewCompaction[], AppNewBrazilian[], AppNewTension[], AppNewBending[], AppNewBendingGeo[], AppNewBrazilianGeo[];
extern const char AppNewBeam[], AppNewBeamGeo[], AppNewBeamMeasured[], AppNewCutting[], AppNewCuttingGeo[], AppNewCuttingPick[]; /* made of examples/ */
extern const char AppNewCuttingTurning[], AppNewCuttingTurningGeo[], AppNewDisc[], AppNewCuttingSolid[], AppNewDiscSolid[], AppNewBlockSolid[], AppNewImpact[], AppNewImpactGeo[], AppNewSpall[], AppNewSpallGeo[];
extern const char AppNewPlate[], AppNewPlateGeo[], AppNewOverlapWave[], AppNewOverlapWaveGeo[], AppNewOverlapBeam[], AppNewOverlapBeamGeo[];
