!! What razy-modes finds for a machine of any scene but `rotor`: natural frequencies and shapes with contacts in a chosen state.
module razy_study_modes_machine
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_eigen_damped, only: damped_eigen
   use razy_eigen_free_modes, only: modes_beside
   use razy_eigen_mode_branches, only: energy_shares, hertz
   use razy_input_input, only: input_t
   use razy_linalg_dense, only: congruence_of, rising_order
   use razy_linalg_generalised, only: dense_modes, eigenpairs_t
   use razy_machine_free_motions, only: linear_free_motions
   use razy_machine_linearised, only: linear_curved, linear_no_equilibrium, linear_rigid, linearise
   use razy_machine_machine, only: machine_t
   use razy_study_modes_result, only: modes_result_t
   implicit none(type, external)
   private

   public :: find_machine_modes

contains

   !> The `count` lowest modes with the contacts in the state `contacts` of `linearised`.
   subroutine find_machine_modes(content, machine, input, count, contacts, error)
      type(modes_result_t), intent(inout) :: content
      type(machine_t), intent(in) :: machine
      type(input_t), intent(in) :: input
      integer, intent(in) :: count, contacts
      type(error_t), allocatable, intent(out) :: error

      type(eigenpairs_t) :: modes
      real(wp), allocatable :: basis(:, :), damping(:, :), of_stiffness(:, :), share(:, :), slope(:, :), squared(:), &
                               stiffness(:, :), untouched(:, :)
      integer, allocatable :: smallest(:)
      complex(wp), allocatable :: values(:)
      integer :: culprit, kept, status

      call linearise(machine, contacts, stiffness, damping, status, culprit, slope)
      if (status == linear_no_equilibrium) then
         call input%complain(error, "modes", 1, "contacts", "'closed' or 'open', or constant loads that are in equilibrium")
      else if (status == linear_rigid) then
         call input%complain(error, "modes", 1, "contacts", "'open': the contact "//machine%contact(culprit)%name// &
                             " is rigid")
      else if (status == linear_curved) then
         call input%complain(error, "modes", 1, "contacts", "'open': the contact "//machine%contact(culprit)%name// &
                             " is not piecewise linear")
      end if
      if (allocated(error)) return
      call linear_free_motions(machine, slope, of_stiffness, untouched)
      call modes_beside(stiffness, machine%mass, of_stiffness, untouched, squared, basis, status)
      if (status == 0) call damped_eigen(squared, congruence_of(damping, basis), values, status)
      modes = dense_modes(stiffness, machine%mass)
      if (status == 0) status = modes%status
      if (status /= 0) then
         call raise(error, "the eigenproblem could not be solved")
         return
      end if
      kept = min(count, size(modes%value))
      smallest = rising_order(abs(modes%value))
      allocate (content%rigid(size(modes%value)), source=0)
      content%rigid(smallest(:size(of_stiffness, 2))) = 1
      where (content%rigid == 1) modes%value = 0.0_wp
      content%rigid = content%rigid(:kept)
      content%free = ""
      share = energy_shares(modes%vector, machine%mass)
      content%coordinate = machine%coordinate
      content%part = content%coordinate
      content%natural = hertz(modes%value(:kept))
      content%shape = modes%vector(:, :kept)
      content%share = share(:, :kept)
      content%speed = [0.0_wp]
      content%frequency = reshape(content%natural, [kept, 1])
      values = [spread((0.0_wp, 0.0_wp), 1, size(untouched, 2)), values]
      content%eigenvalue = reshape(values, [size(values), 1])
   end subroutine find_machine_modes

end module razy_study_modes_machine
