!! Rotor systems for tests: uniform shafts, and the test gearbox (source thesis, 4.2.3) with the values chosen for it.
module rotor_samples
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_rotor_bearing, only: bearing_t, rolling_bearing, rolling_row_t
   use razy_rotor_disk, only: disk_t
   use razy_rotor_free_motions, only: in_coordinates, rigid_motions
   use razy_rotor_gear_mesh, only: gear_mesh_t
   use razy_rotor_model, only: new_rotor_model, rotor_model_t
   use razy_rotor_reduction_reduced, only: reduced_t
   use razy_rotor_rotor, only: damping_nodal, rotor_t, shaft_t, support_t, unbalance_t
   use razy_rotor_section, only: material_t, section_t, shear_none
   use razy_rotor_whirl_whirl, only: new_whirl, whirl_problem_t
   implicit none(type, external)
   private

   public :: assembled, free_whirl, gearbox, gearbox_with, pinned_shaft, steel, uniform_shaft

contains

   !> The steel of the thesis's gearbox, G inferred.
   pure function steel() result(material)
      type(material_t) :: material

      material = material_t(young=2.1e11_wp, shear=8.0e10_wp, density=7850.0_wp)
   end function steel

   !> A rotor of one uniform shaft, free.
   function uniform_shaft(length, diameter, elements, shear) result(rotor)
      real(wp), intent(in) :: length, diameter
      integer, intent(in) :: elements, shear
      type(rotor_t) :: rotor

      allocate (rotor%shaft(1), rotor%disk(0), rotor%bearing(0), rotor%support(0), rotor%mesh(0))
      allocate (rotor%unbalance(0), rotor%shaft(1)%section(1))
      rotor%shaft(1)%name = "shaft"
      rotor%shaft(1)%shear = shear
      rotor%shaft(1)%section(1) = section_t(steel(), length, diameter, 0.0_wp, elements)
   end function uniform_shaft

   !> The same held at its ends: all displacements at the first node, lateral ones at the last, twist at the first.
   function pinned_shaft(length, diameter, elements, shear) result(rotor)
      real(wp), intent(in) :: length, diameter
      integer, intent(in) :: elements, shear
      type(rotor_t) :: rotor

      rotor = uniform_shaft(length, diameter, elements, shear)
      deallocate (rotor%support)
      allocate (rotor%support(2))
      rotor%support(1) = support_t(1, 1, [.true., .true., .true., .true., .false., .false.])
      rotor%support(2) = support_t(1, elements + 1, [.false., .true., .true., .false., .false., .false.])
   end function pinned_shaft

   !> The model of a rotor that has no error.
   function assembled(rotor) result(model)
      type(rotor_t), intent(in) :: rotor
      type(rotor_model_t) :: model

      type(error_t), allocatable :: error

      call new_rotor_model(model, rotor, error)
      if (allocated(error)) error stop "a sample is no rotor"
   end function assembled

   !> The test gearbox.
   function gearbox() result(rotor)
      type(rotor_t) :: rotor

      rotor = gearbox_with([2, 10, 2])
   end function gearbox

   !> The same with other numbers of elements in the three sections.
   function gearbox_with(elements) result(rotor)
      integer, intent(in) :: elements(3)
      type(rotor_t) :: rotor

      type(rolling_row_t) :: balls, rollers
      integer :: first, gear, last, s

      allocate (rotor%shaft(2), rotor%disk(2), rotor%bearing(4), rotor%support(2), rotor%mesh(1))
      allocate (rotor%unbalance(0))
      ! radial 1.75e8, axial 3e7 N/m in total, any number of balls
      balls = rolling_row_t(elements=8, radial=1.75e8_wp/4, axial=3.0e7_wp/8)
      rollers = rolling_row_t(elements=4, radial=3.5e8_wp)
      first = elements(1) + 1
      gear = first + elements(2)/2
      last = first + elements(2)
      do s = 1, 2
         rotor%shaft(s)%name = merge("input ", "output", s == 1)
         rotor%shaft(s)%shear = shear_none
         rotor%shaft(s)%speed_ratio = merge(1.0_wp, -1.0_wp, s == 1)
         rotor%shaft(s)%damping_ratio = 0.005_wp
         allocate (rotor%shaft(s)%section(3))
         rotor%shaft(s)%section(1) = section_t(steel(), 0.06_wp, 0.03_wp, 0.0_wp, elements(1))
         rotor%shaft(s)%section(2) = section_t(steel(), 0.26_wp, 0.04_wp, 0.0_wp, elements(2))
         rotor%shaft(s)%section(3) = section_t(steel(), 0.06_wp, 0.03_wp, 0.0_wp, elements(3))
         rotor%disk(s) = disk_t(s, gear, 2.3675_wp, 8.0495e-3_wp, 4.0753e-3_wp, 0.0_wp)
         rotor%bearing(2*s - 1) = rolling_bearing(s, first, balls)
         rotor%bearing(2*s) = rolling_bearing(s, last, rollers)
      end do
      rotor%support(1) = support_t(1, 1, [.false., .false., .false., .true., .false., .false.])
      rotor%support(2) = support_t(2, sum(elements) + 1, [.false., .false., .false., .true., .false., .false.])
      rotor%mesh(1)%shaft = [1, 2]
      rotor%mesh(1)%node = gear
      rotor%mesh(1)%radius = 0.08_wp
      rotor%mesh(1)%pressure = 20.0_wp
      rotor%mesh(1)%helix = 15.0_wp
      rotor%mesh(1)%stiffness = 4.0e8_wp
      rotor%mesh(1)%damping = 2000.0_wp
      rotor%damping = damping_nodal
   end function gearbox_with

   !> The problem over the speed with meshes closed, without the rigid motions that nothing feels.
   function free_whirl(model, reduced) result(problem)
      type(rotor_model_t), intent(in) :: model
      type(reduced_t), intent(in) :: reduced
      type(whirl_problem_t) :: problem

      real(wp), allocatable :: free(:, :), motion(:, :), still(:, :), untouched(:, :)

      call rigid_motions(model, .true., .true., .true., .true., motion, still)
      call in_coordinates(model, reduced, motion, free)
      call in_coordinates(model, reduced, still, untouched)
      problem = new_whirl(reduced, .true., free, untouched)
      problem%resting = size(free, 2) - size(untouched, 2)
   end function free_whirl

end module rotor_samples
