!! Loads and unbalance of a rotor scene, and the coordinates that its groups name.
module razy_scenes_rotor_loads
   use razy_core_error, only: error_t
   use razy_input_input, only: input_t
   use razy_core_kinds, only: pi, qp, wp
   use razy_machine_machine, only: machine_t
   use razy_rotor_model, only: rotor_model_t
   use razy_rotor_reduction_reduced, only: reduced_t
   use razy_scenes_harmonics, only: add_harmonic, harmonics_t, read_load
   use razy_scenes_rotor_places, only: find_coordinate
   implicit none(type, external)
   private

   public :: add_loads, add_unbalance, find_row

contains

   !> Constant and harmonic loads.
   subroutine add_loads(machine, model, reduced, input, harmonics, error)
      type(machine_t), intent(inout) :: machine
      type(rotor_model_t), intent(in) :: model
      type(reduced_t), intent(in) :: reduced
      type(input_t), intent(in) :: input
      type(harmonics_t), intent(inout) :: harmonics
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: row(:)
      real(wp) :: cosine, sine, value
      real(qp) :: hertz
      integer :: at, i, k

      do i = 1, input%count("load")
         call find_row(model, reduced, input, "load", i, "on", row, at, error)
         if (.not. allocated(error)) call read_load(input, i, value, cosine, sine, hertz, error)
         if (allocated(error)) return
         machine%load = machine%load + value*row
         do k = 1, size(row)
            call add_harmonic(harmonics, k, hertz, cosine*row(k), sine*row(k))
         end do
      end do
   end subroutine add_loads

   !> Unbalance of shaft s at its angular speed omega: Re(U omega² e^(i omega t)).
   subroutine add_unbalance(model, reduced, ratio, input, harmonics, error)
      type(rotor_model_t), intent(in) :: model
      type(reduced_t), intent(in) :: reduced
      real(qp), intent(in) :: ratio(:)
      type(input_t), intent(in) :: input
      type(harmonics_t), intent(inout) :: harmonics
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: speed
      real(qp) :: hertz
      integer :: i, k, s

      if (input%count("unbalance") == 0) return
      if (input%count("rotation") == 0) then
         call input%complain(error, "unbalance", 1, "moment", "an unbalance needs &rotation")
         return
      end if
      call input%get("rotation", 1, "speed_rpm", speed)
      do i = 1, size(model%rotor%unbalance)
         if (abs(ratio(model%rotor%unbalance(i)%shaft)) > 0.0_qp) cycle
         call input%complain(error, "unbalance", i, "shaft", "a shaft whose speed is known, from teeth or speed_ratio")
         return
      end do
      do s = 1, size(ratio)
         hertz = ratio(s)*speed/60.0_qp
         associate (force => reduced%unbalance(:, s)*(2*pi*real(hertz, wp))**2)
            do k = 1, size(force)
               call add_harmonic(harmonics, k, hertz, real(force(k), wp), -aimag(force(k)))
            end do
         end associate
      end do
   end subroutine add_unbalance

   !> The coordinate that a key names as a row on those of the machine, and its number in the model.
   subroutine find_row(model, reduced, input, group, i, key, row, at, error)
      type(rotor_model_t), intent(in) :: model
      type(reduced_t), intent(in) :: reduced
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group, key
      integer, intent(in) :: i
      real(wp), allocatable, intent(out) :: row(:)
      integer, intent(out) :: at
      type(error_t), allocatable, intent(out) :: error

      integer :: index(6), node, shaft, which

      at = 0
      call find_coordinate(model%rotor, input, group, i, key, shaft, node, which, error)
      if (allocated(error)) return
      index = model%numbering%of(shaft, node)
      at = index(which)
      if (at == 0) then
         call input%complain(error, group, i, key, "a coordinate that is neither held by a &support nor left out by &freedom")
      else
         row = reduced%basis(at, :)
      end if
   end subroutine find_row

end module razy_scenes_rotor_loads
