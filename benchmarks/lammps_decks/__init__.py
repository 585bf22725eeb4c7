"""What grains near walls and sorted grains make of the speed of LAMMPS decks."""
