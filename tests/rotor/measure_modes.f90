!! A pinned shaft of many elements: time of its assembly and of its 50 lowest modes, and their errors against theory.
!!
!! Usage: measure_modes ELEMENTS, or measure_modes campbell SPEEDS for the reduced test gearbox with mesh (48 coordinates).
!! Standard output: `key value` lines; processor times in s.
program measure_modes
   use, intrinsic :: iso_fortran_env, only: output_unit
   use razy_core_error, only: error_t
   use razy_core_kinds, only: pi, wp
   use razy_eigen_spectrum, only: spectrum_t
   use razy_linalg_generalised, only: eigenpairs_t, modes_found
   use razy_rotor_model, only: rotor_model_t
   use razy_rotor_whirl_modes, only: energy_shares, natural_modes
   use razy_rotor_reduction_reduced, only: reduced_t
   use razy_rotor_section, only: shear_none
   use razy_rotor_reduction_synthesis, only: modal_synthesis
   use razy_rotor_whirl_whirl, only: new_whirl, whirl_problem_t
   use rotor_samples, only: assembled, gearbox, pinned_shaft
   implicit none(type, external)

   integer, parameter :: modes = 50
   real(wp), parameter :: length = 0.38_wp, diameter = 0.04_wp
   character(16) :: word
   integer :: number

   call get_command_argument(1, word)
   if (word == "campbell") then
      call get_command_argument(2, word)
      read (word, *) number
      call measure_campbell(number)
   else
      read (word, *) number
      call measure_shaft(number)
   end if

contains

   subroutine measure_shaft(elements)
      integer, intent(in) :: elements

      type(rotor_model_t) :: model
      type(eigenpairs_t) :: pairs
      real(wp) :: begin, error(3), middle, share(4), theory, finish
      integer :: found(4), i, kind

      call cpu_time(begin)
      model = assembled(pinned_shaft(length, diameter, elements, shear_none))
      call cpu_time(middle)
      pairs = natural_modes(model, modes, meshed=.false.)
      call cpu_time(finish)
      if (pairs%status /= modes_found) error stop "the modes were not found"
      found = 0
      error = 0.0_wp
      do i = 1, modes
         share = energy_shares(model, pairs%vector(:, i))
         kind = min(maxloc(share, dim=1), 3)
         found(kind) = found(kind) + 1
         select case (kind)
         case (1)
            theory = (found(1) - 0.5_wp)*pi/length*sqrt(2.1e11_wp/7850)
         case (2)
            theory = (found(2) - 0.5_wp)*pi/length*sqrt(8.0e10_wp/7850)
         case default
            theory = rayleigh((found(3) + 1)/2)
         end select
         error(kind) = max(error(kind), abs(sqrt(pairs%value(i))/theory - 1))
      end do
      write (output_unit, "(a, i0)") "coordinates ", model%numbering%n, "axial ", found(1), "torsional ", found(2), &
         "bending ", found(3)
      write (output_unit, "(a, es12.4)") "assembly ", middle - begin, "modes ", finish - middle, "axial_error ", error(1), &
         "torsional_error ", error(2), "bending_error ", error(3)
   end subroutine measure_shaft

   pure function rayleigh(m) result(omega)
      integer, intent(in) :: m
      real(wp) :: omega

      associate (area => pi*diameter**2/4, second => pi*diameter**4/64, k => m*pi/length)
         omega = sqrt(2.1e11_wp*second*k**4/(7850*(area + second*k**2)))
      end associate
   end function rayleigh

   subroutine measure_campbell(speeds)
      integer, intent(in) :: speeds

      type(reduced_t) :: reduced
      type(whirl_problem_t) :: problem
      type(spectrum_t) :: whirl
      type(error_t), allocatable :: error
      real(wp) :: begin, finish
      integer :: i

      call modal_synthesis(reduced, assembled(gearbox()), [24, 24], 0.0_wp, error)
      if (allocated(error)) error stop "the gearbox was not reduced"
      problem = new_whirl(reduced, meshed=.true.)
      call cpu_time(begin)
      do i = 1, speeds
         problem%circulatory = .true.
         call problem%solve(10.0_wp*i, whirl, error)
         if (allocated(error)) error stop "an eigenproblem failed"
      end do
      call cpu_time(finish)
      write (output_unit, "(a, i0)") "speeds ", speeds
      write (output_unit, "(a, es12.4)") "campbell ", finish - begin
   end subroutine measure_campbell

end program measure_modes
