# Every library we link, as one interface target each. PETSC_DIR (and PETSC_ARCH) point at another PETSc than the system's.
find_package(PkgConfig REQUIRED)
find_package(MPI REQUIRED COMPONENTS C)
find_package(OpenMP REQUIRED COMPONENTS C)

if(DEFINED ENV{PETSC_DIR})
  set(ENV{PKG_CONFIG_PATH} "$ENV{PETSC_DIR}/$ENV{PETSC_ARCH}/lib/pkgconfig:$ENV{PETSC_DIR}/lib/pkgconfig:$ENV{PKG_CONFIG_PATH}")
endif()
pkg_check_modules(PETSC REQUIRED IMPORTED_TARGET PETSc>=3.18)
find_package(LAPACK REQUIRED) # small eigenvalue problems call it through petscblaslapack.h; PETSc's .pc leaves it private
target_link_libraries(PkgConfig::PETSC INTERFACE ${LAPACK_LIBRARIES})
pkg_check_modules(SLEPC IMPORTED_TARGET slepc) # eigenfrequencies (time.method: modal); a build without it refuses them by name
pkg_search_module(HDF5 REQUIRED IMPORTED_TARGET hdf5-openmpi hdf5-mpi)
pkg_check_modules(YAML REQUIRED IMPORTED_TARGET yaml-0.1)
pkg_check_modules(UDUNITS REQUIRED IMPORTED_TARGET udunits)
pkg_check_modules(CMOCKA REQUIRED IMPORTED_TARGET cmocka)

find_path(GMSH_INCLUDE gmshc.h REQUIRED)
find_library(GMSH_LIBRARY gmsh REQUIRED)
add_library(gmsh_c INTERFACE)
target_include_directories(gmsh_c SYSTEM INTERFACE ${GMSH_INCLUDE})
target_link_libraries(gmsh_c INTERFACE ${GMSH_LIBRARY})

find_path(VORO_INCLUDE voro++/voro++.hh REQUIRED)
find_library(VORO_LIBRARY voro++ REQUIRED)
add_library(voro INTERFACE)
target_include_directories(voro SYSTEM INTERFACE ${VORO_INCLUDE})
target_link_libraries(voro INTERFACE ${VORO_LIBRARY})
